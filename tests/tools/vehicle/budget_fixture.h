#pragma once
// `rcs budget` with a vehicle configuration for the test.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/support/rcs_command.h"

namespace rcs::test {

class BudgetCommand : public RcsCommand {
 protected:
  /// Demo III scans of a given duration, and the vehicle with `limits` as its [budget].
  void prepare(const std::string& seconds, const std::string& limits) {
    const std::string root = variable("RCS_SOURCE_DIR");
    ASSERT_EQ(rcs("sim " + root + "/config/sim/demo.toml --duration " + seconds + " -o " + log()),
              0)
        << messages();
    std::string config = text_of(root + "/config/demo3.toml");
    // These replace the budgets and processes of the vehicle's configuration.
    for (const char* table : {"\n[budget]", "\n[up]"}) {
      const std::size_t from = config.find(table);
      if (from == std::string::npos) continue;
      config.erase(from, config.find("\n[", from + 1) - from);
    }
    std::ofstream(vehicle()) << config << "\n[up]\nnodes = [\"sp\", \"wm\"]\n[budget]\n" << limits;
  }
  [[nodiscard]] std::string log() const { return folder_ + "/demo.log"; }
  [[nodiscard]] std::string vehicle() const { return folder_ + "/vehicle.toml"; }
};

}  // namespace rcs::test
