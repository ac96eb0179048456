// Drives with moving people and vehicles (config/sim/actors.toml): `ctest -L slow -R ActorDrives
// -V` prints the table. RCS_FIRST_SEED, RCS_DRIVES: other seeds, and their number.

#include <gtest/gtest.h>

#include "tests/replay/drive_series.h"

namespace rcs::test {
namespace {

TEST(ActorDrives, NoContact) {
  driving::DriveCampaign campaign;
  campaign.scenario = source_path("config/sim/actors.toml");
  campaign.vehicle_config = source_path("config/demo3.toml");
  const int first_seed = number_from("RCS_FIRST_SEED", 1001);
  for (const auto& [seed, run] :
       drive_series(campaign, first_seed, number_from("RCS_DRIVES", 12))) {
    EXPECT_EQ(driving::contacts(run), 0) << "seed " << seed;
    EXPECT_TRUE(run.done) << "seed " << seed;
  }
}

}  // namespace
}  // namespace rcs::test
