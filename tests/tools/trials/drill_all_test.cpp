// All daily drills, as run by `rcs drill --all`. Failures are printed; the limits determine how
// many may fail.

#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

class DrillAll : public RcsCommand {};

TEST_F(DrillAll, EveryDrillPasses) {
  const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
  const int status = rcs("drill --all --folder " + config + "drills --scenario " + config +
                         "sim/drill.toml --config " + config + "demo3.toml -o " + folder_);
  std::printf("%s\n", out().c_str());
  EXPECT_EQ(status, 0) << messages();
  const auto results = nlohmann::json::parse(text_of(folder_ + "/results.json"));
  for (const auto& drill : results["drills"]) {
    for (const auto& limit : drill["limits"]) {
      EXPECT_NE(limit["verdict"], "FAIL") << drill["id"] << ": " << limit.dump();
    }
  }
}

}  // namespace
}  // namespace rcs::test
