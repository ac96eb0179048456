#pragma once
// `rcs` on the command line, with a folder for each test.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "rcs/base/check.h"

namespace rcs::test {

inline std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "." : value;
}

inline std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

class RcsCommand : public testing::Test {
 protected:
  RcsCommand() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_command_XXXXXX").string();
    RCS_CHECK(mkdtemp(folder_.data()) != nullptr);
  }
  ~RcsCommand() override { std::filesystem::remove_all(folder_); }

  /// Exit status; stdout and stderr are out() and messages() afterwards.
  int rcs(const std::string& arguments) {
    const std::string command = variable("RCS_BIN_DIR") + "/rcs " + arguments + " >" + folder_ +
                                "/out 2>" + folder_ + "/messages";
    const int status = std::system(command.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string out() const { return text_of(folder_ + "/out"); }
  [[nodiscard]] std::string messages() const { return text_of(folder_ + "/messages"); }

  std::string folder_;
};

}  // namespace rcs::test
