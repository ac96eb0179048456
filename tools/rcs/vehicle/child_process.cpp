#include "tools/rcs/vehicle/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace rcs::cli {
namespace {

constexpr int kCannotExecute = 127;  // as in a shell

void write_all(int fd, const char* text) {
  // A failure is ignored: the child is about to end.
  (void)!write(fd, text, std::strlen(text));
}

/// Runs between fork and exec: only calls that are safe after a fork of a process with threads.
[[noreturn]] void become(const char* program, char* const* argv, int output, int parent) {
  // A node that hangs would not react to SIGTERM.
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotExecute);  // the parent has already ended
  (void)setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  (void)sigprocmask(SIG_SETMASK, &none, nullptr);
  const int empty = open("/dev/null", O_RDONLY | O_CLOEXEC);
  (void)dup2(empty, STDIN_FILENO);
  (void)dup2(output, STDOUT_FILENO);
  (void)dup2(output, STDERR_FILENO);
  // LCM does not set close-on-exec: a copied socket in the child would receive messages unread.
  (void)close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  execv(program, argv);
  write_all(STDERR_FILENO, "cannot execute ");
  write_all(STDERR_FILENO, program);
  write_all(STDERR_FILENO, "\n");
  _exit(kCannotExecute);
}

bool is_executable(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

}  // namespace

void LineCutter::add(std::string_view bytes, const Sink& sink) {
  for (const char c : bytes) {
    if (c == '\n' || c == '\r') {
      flush(sink);
    } else {
      line_ += c;
      if (line_.size() >= kMaxLine) flush(sink);
    }
  }
}

void LineCutter::flush(const Sink& sink) {
  if (!line_.empty()) sink(line_);
  line_.clear();
}

Result<ChildProcess> ChildProcess::start(const std::string& program,
                                         const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return Error{std::strerror(errno)};
  FileHandle output(ends[0]);
  const FileHandle input(ends[1]);
  (void)fcntl(output.get(), F_SETFL, O_NONBLOCK);
  const int parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) return Error{fmt::format("cannot start {}: {}", program, std::strerror(errno))};
  if (pid == 0) become(program.c_str(), argv.data(), input.get(), parent);
  // Not by <sys/pidfd.h>, which glibc 2.36 declares as C++.
  FileHandle exit(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
  if (!exit.valid()) {
    const int reason = errno;
    (void)kill(pid, SIGKILL);
    (void)waitpid(pid, nullptr, 0);
    return Error{fmt::format("cannot watch {}: {}", program, std::strerror(reason))};
  }
  return ChildProcess(pid, std::move(exit), std::move(output));
}

void ChildProcess::send_signal(int signal) const { (void)kill(pid_, signal); }

void ChildProcess::read_output(const LineCutter::Sink& sink) {
  std::array<char, 4096> bytes{};
  while (output_.valid()) {
    const ssize_t n = read(output_.get(), bytes.data(), bytes.size());
    if (n > 0) {
      cutter_.add({bytes.data(), static_cast<std::size_t>(n)}, sink);
    } else if (n == 0) {
      cutter_.flush(sink);
      (void)output_.close();
    } else if (errno != EINTR) {
      return;
    }
  }
}

std::optional<Exit> ChildProcess::collect() {
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  return WIFSIGNALED(status) ? Exit{true, WTERMSIG(status)} : Exit{false, WEXITSTATUS(status)};
}

Result<std::string> find_program(const std::string& name) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path in_own_folder = self.parent_path() / name;
  if (is_executable(in_own_folder)) return in_own_folder.string();
  const char* variable = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe)
  std::string_view path = variable == nullptr ? "" : variable;
  while (!path.empty()) {
    const std::string_view folder = path.substr(0, path.find(':'));
    path.remove_prefix(std::min(folder.size() + 1, path.size()));
    const std::filesystem::path candidate = std::filesystem::path(folder) / name;
    if (!folder.empty() && is_executable(candidate)) return candidate.string();
  }
  return Error{fmt::format("no program {} in {} or in PATH", name, self.parent_path().string())};
}

std::string to_text(const Exit& exit) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  return exit.by_signal
             ? fmt::format("was killed by signal {} ({})", exit.code, strsignal(exit.code))
             : fmt::format("ended with status {}", exit.code);
}

}  // namespace rcs::cli
