// Drives with a hazard across each leg of the course (config/sim/hazards.toml): `ctest -L slow -R
// HazardDrives -V` prints the tables. RCS_FIRST_SEED, RCS_DRIVES: other seeds, and their number for
// each kind of hazard. RCS_MORE_CONFIG: TOML text behind the vehicle's configuration.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/replay/drive_series.h"
#include "tests/support/fresh_folder.h"

namespace rcs::test {
namespace {

class HazardDrives : public testing::TestWithParam<const char*> {};

TEST_P(HazardDrives, NoContact) {
  driving::DriveCampaign campaign;
  campaign.scenario = (fresh_folder() / "scenario.toml").string();
  std::ofstream(campaign.scenario) << "based_on = \"" << source_path("config/sim/hazards.toml")
                                   << "\"\n[hazards]\nkinds = [\"" << GetParam() << "\"]\n";
  const char* const more = std::getenv("RCS_MORE_CONFIG");  // NOLINT(concurrency-mt-unsafe)
  if (more != nullptr) campaign.more_config = more;
  const int first_seed = number_from("RCS_FIRST_SEED", 501);
  for (const auto& [seed, run] : drive_series(campaign, first_seed, number_from("RCS_DRIVES", 4))) {
    EXPECT_EQ(driving::contacts(run), 0) << "seed " << seed;
    EXPECT_TRUE(run.done) << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, HazardDrives,
                         testing::Values("drop", "ledge", "ditch", "wall", "bank"),
                         [](const auto& kind) { return std::string(kind.param); });

}  // namespace
}  // namespace rcs::test
