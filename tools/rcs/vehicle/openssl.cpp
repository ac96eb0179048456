#include "tools/rcs/vehicle/openssl.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <utility>

#include "rcs/base/file_handle.h"

namespace rcs::cli {
namespace {

struct Pipe {
  FileHandle from, to;
};

Result<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return Error{"cannot create a pipe to openssl"};
  return Pipe{FileHandle(ends[0]), FileHandle(ends[1])};
}

/// Reads both ends until both are closed, so that neither can block the program.
void read_both(const FileHandle& out, std::string* result, const FileHandle& err,
               std::string* said) {
  std::array<pollfd, 2> polled = {{{out.get(), POLLIN, 0}, {err.get(), POLLIN, 0}}};
  const std::array<std::string*, 2> texts = {result, said};
  std::array<char, 512> buffer{};
  while (polled[0].fd >= 0 || polled[1].fd >= 0) {
    if (::poll(polled.data(), polled.size(), -1) < 0) return;
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if (polled[i].fd < 0 || polled[i].revents == 0) continue;
      const ssize_t n = ::read(polled[i].fd, buffer.data(), buffer.size());
      if (n > 0) {
        texts[i]->append(buffer.data(), static_cast<std::size_t>(n));
      } else {
        polled[i].fd = -1;
      }
    }
  }
}

}  // namespace

Result<std::string> openssl_output(std::vector<std::string> args) {
  args.insert(args.begin(), "openssl");
  std::vector<char*> argv;
  argv.reserve(args.size() + 1);
  for (std::string& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);

  Result<Pipe> out = make_pipe();
  if (!out) return out.error();
  Result<Pipe> err = make_pipe();
  if (!err) return err.error();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out->to.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err->to.get(), STDERR_FILENO);
  pid_t pid = -1;
  const int failed = ::posix_spawnp(&pid, "openssl", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  (void)out->to.close();
  (void)err->to.close();
  if (failed != 0) {
    return Error{
        fmt::format("cannot run openssl ({}); install the package openssl", std::strerror(failed))};
  }
  std::string result;
  std::string said;
  read_both(out->from, &result, err->from, &said);
  int status = 0;
  if (::waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return result;
  }
  return Error{fmt::format("openssl {} failed: {}", args[1], said)};
}

Outcome run_openssl(std::vector<std::string> args) {
  const Result<std::string> output = openssl_output(std::move(args));
  return output ? Outcome(Done{}) : Outcome(output.error());
}

}  // namespace rcs::cli
