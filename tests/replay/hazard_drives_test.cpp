// Drives with a hazard across each leg of the course (config/sim/hazards.toml and
// hazards_fast.toml): `ctest -L slow -R HazardDrives -V` prints the tables. RCS_FIRST_SEED,
// RCS_DRIVES: other seeds, and their number for each kind of hazard. RCS_MORE_CONFIG: TOML text
// behind the vehicle's configuration.

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/replay/drive_series.h"
#include "tests/support/fresh_folder.h"

namespace rcs::test {
namespace {

struct Course {
  const char* name;
  const char* scenario;
  const char* kind;
};

class HazardDrives : public testing::TestWithParam<Course> {};

TEST_P(HazardDrives, NoContact) {
  driving::DriveCampaign campaign;
  campaign.scenario = (fresh_folder() / "scenario.toml").string();
  std::ofstream(campaign.scenario) << "based_on = \"" << source_path(GetParam().scenario)
                                   << "\"\n[hazards]\nkinds = [\"" << GetParam().kind << "\"]\n";
  const char* const more = std::getenv("RCS_MORE_CONFIG");  // NOLINT(concurrency-mt-unsafe)
  if (more != nullptr) campaign.more_config = more;
  const int first_seed = number_from("RCS_FIRST_SEED", 501);
  for (const auto& [seed, run] : drive_series(campaign, first_seed, number_from("RCS_DRIVES", 4))) {
    EXPECT_EQ(driving::contacts(run), 0) << "seed " << seed;
    EXPECT_TRUE(run.done) << "seed " << seed;
  }
}

constexpr const char* kSlow = "config/sim/hazards.toml";
constexpr const char* kFast = "config/sim/hazards_fast.toml";

INSTANTIATE_TEST_SUITE_P(
    Kinds, HazardDrives,
    testing::Values(Course{"drop", kSlow, "drop"}, Course{"ledge", kSlow, "ledge"},
                    Course{"ditch", kSlow, "ditch"}, Course{"wall", kSlow, "wall"},
                    Course{"bank", kSlow, "bank"}, Course{"fast_ditch", kFast, "ditch"},
                    Course{"fast_drop", kFast, "drop"}),
    [](const auto& course) { return std::string(course.param.name); });

}  // namespace
}  // namespace rcs::test
