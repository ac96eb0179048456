// `rcs consistency` on the whole chain: statistics that miss their limits significantly are
// printed.

#include <gmock/gmock.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

class ConsistencyCommand : public RcsCommand {};

TEST_F(ConsistencyCommand, FilterErrorsAreConsistentWithThePublishedCovariances) {
  const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
  std::string drives;
  for (const char* name : {"meadow", "rocky_hills", "wooded_valley"}) {
    drives += " --scenario " + config + "sim/" + name + ".toml";
  }
  const int status =
      rcs("consistency --seeds 5 --config " + config + "demo3.toml -o " + folder_ + drives);
  std::printf("%s\n", out().c_str());
  EXPECT_EQ(status, 0) << messages();
  const auto results = nlohmann::json::parse(text_of(folder_ + "/consistency.json"));
  EXPECT_EQ(results["blocks"].size(), 9U);
  for (const auto& block : results["blocks"]) {
    EXPECT_NE(block["verdict"], "FAIL") << block["scenario"] << ", " << block["ins"];
    for (const char* part : {"position", "velocity", "attitude"}) {
      EXPECT_EQ(block[part]["at"].size(), 4U);
      for (const auto& at : block[part]["at"]) EXPECT_EQ(at["runs"], 5) << at.dump();
    }
  }
  EXPECT_THAT(text_of(folder_ + "/consistency.html"), HasSubstr("</svg>"));
}

}  // namespace
}  // namespace rcs::test
