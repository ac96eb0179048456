#include "tests/gateway/program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>

namespace rcs::test {
namespace {

std::vector<char*> pointers(std::vector<std::string>* texts) {
  std::vector<char*> out;
  for (std::string& t : *texts) out.push_back(t.data());
  out.push_back(nullptr);
  return out;
}

}  // namespace

Program::Program(std::vector<std::string> command, std::vector<std::string> environment) {
  for (char** e = environ; *e != nullptr; ++e) environment.emplace_back(*e);
  const std::vector<char*> argv = pointers(&command);
  const std::vector<char*> envp = pointers(&environment);

  std::array<int, 2> ends{};
  EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK), 0);
  from_ = FileHandle(ends[0]);
  const FileHandle to(ends[1]);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, to.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, to.get(), STDERR_FILENO);
  EXPECT_EQ(::posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), envp.data()), 0)
      << argv[0];
  posix_spawn_file_actions_destroy(&actions);
}

Program::~Program() {
  if (status() >= 0) return;
  signal(SIGKILL);
  (void)::waitpid(pid_, nullptr, 0);
}

const std::string& Program::output() {
  std::array<char, 4096> buffer{};
  for (ssize_t n = 0; (n = ::read(from_.get(), buffer.data(), buffer.size())) > 0;) {
    output_.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return output_;
}

int Program::status() {
  int status = 0;
  if (status_ < 0 && pid_ > 0 && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return status_;
}

void Program::signal(int number) const {
  if (pid_ > 0 && status_ < 0) (void)::kill(pid_, number);
}

double Program::memory_mb() const {
  std::ifstream statm("/proc/" + std::to_string(pid_) + "/statm");
  double all = 0.0;
  double resident = 0.0;
  statm >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::string program_path(const std::string& name) {
  const char* const folder = std::getenv("RCS_BIN_DIR");
  EXPECT_NE(folder, nullptr) << "RCS_BIN_DIR must be the build's folder of programs";
  return std::string(folder == nullptr ? "." : folder) + "/" + name;
}

}  // namespace rcs::test
