#pragma once
// A child process of a test whose output can be read while it runs.

#include <csignal>
#include <string>
#include <vector>

#include "rcs/base/file_handle.h"

namespace rcs::test {

class Program {
 public:
  /// @param environment  "NAME=value" in addition to the environment of the test
  Program(std::vector<std::string> command, std::vector<std::string> environment);
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program();  ///< kills the process if it still runs

  /// Output so far, stdout and stderr.
  const std::string& output();
  [[nodiscard]] bool has_said(const std::string& text) {
    return output().find(text) != std::string::npos;
  }
  /// Its exit status, -1 while it runs.
  int status();
  void signal(int number) const;
  /// Resident memory of the running process [MB]; 0: unknown.
  [[nodiscard]] double memory_mb() const;

 private:
  pid_t pid_ = -1;
  FileHandle from_;
  std::string output_;
  int status_ = -1;
};

/// Path of a program in the build's folder of programs.
[[nodiscard]] std::string program_path(const std::string& name);

}  // namespace rcs::test
