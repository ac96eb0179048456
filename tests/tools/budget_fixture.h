#pragma once
// `rcs` as a user calls it, with a folder and a vehicle of the test's own.

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

class BudgetCommand : public testing::Test {
 protected:
  BudgetCommand() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_budget_XXXXXX").string();
    RCS_CHECK(mkdtemp(folder_.data()) != nullptr);
  }
  ~BudgetCommand() override { std::filesystem::remove_all(folder_); }

  /// Exit status; stdout and stderr are out() and messages() afterwards.
  int rcs(const std::string& arguments) {
    const std::string command = variable("RCS_BIN_DIR") + "/rcs " + arguments + " >" + folder_ +
                                "/out 2>" + folder_ + "/messages";
    const int status = std::system(command.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string out() const { return text_of(folder_ + "/out"); }
  [[nodiscard]] std::string messages() const { return text_of(folder_ + "/messages"); }

  /// Demo III scans, as long as it takes, and the vehicle with `limits` for its [budget].
  void prepare(const std::string& seconds, const std::string& limits) {
    const std::string root = variable("RCS_SOURCE_DIR");
    ASSERT_EQ(rcs("sim " + root + "/config/sim/demo.toml --duration " + seconds + " -o " + log()),
              0)
        << messages();
    std::string config = text_of(root + "/config/demo3.toml");
    // Whatever the vehicle's own budgets and processes are: here it is these.
    for (const char* table : {"\n[budget]", "\n[up]"}) {
      const std::size_t from = config.find(table);
      if (from == std::string::npos) continue;
      config.erase(from, config.find("\n[", from + 1) - from);
    }
    std::ofstream(vehicle()) << config << "\n[up]\nnodes = [\"sp\", \"wm\"]\n[budget]\n" << limits;
  }
  [[nodiscard]] std::string log() const { return folder_ + "/demo.log"; }
  [[nodiscard]] std::string vehicle() const { return folder_ + "/vehicle.toml"; }

  std::string folder_;
};

}  // namespace rcs::test
