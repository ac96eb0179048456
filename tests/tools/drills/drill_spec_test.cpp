// Drills from TOML, strictly.

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tools/drills/drill_spec.h"

namespace rcs::drills {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr char kGood[] = R"(
name = "Both"
about = "GPS lost, then elsewhere."
needs = "simulator"
seeds = 2

[run]
length_s = 90
scenario = "../sim/drill.toml"
ins = "consumer"
prior_map = true
map_cell_m = 0.5
map_shift_m = [2.0, 0.0, 0.0]
map_turn_deg = 5.0
grant_share = 0.25

[[stimulus]]
kind = "dropout"
source = "gps"
begin_s = 30
length_s = 20

[[stimulus]]
kind = "offset"
begin_s = 50
length_s = 10
offset_m = 50
bearing_deg = 90

[[stimulus]]
kind = "flapping"
source = "gps"
begin_s = 70
on_s = 1
off_s = 4
count = 3

[limits]
accept_within_s = 5
ratio = 1.05
)";

std::string complaint(const std::string& text) {
  const Result<Drill> drill = parse_drill(text, "folder/bad.toml");
  return drill ? "no complaint" : drill.error().message;
}

std::string with_stimulus(const std::string& lines) { return "[[stimulus]]\n" + lines + "\n"; }

TEST(DrillSpec, ReadsAFile) {
  const Result<Drill> drill = parse_drill(kGood, "drills/both.toml");
  ASSERT_TRUE(drill.ok()) << drill.error().message;
  EXPECT_EQ(drill->id, "both");
  EXPECT_EQ(drill->seeds, 2);
  EXPECT_EQ(drill->seeds_full, 20);
  EXPECT_TRUE(drill->needs_simulator);
  EXPECT_THAT(drill->run.scenario, HasSubstr("drills/../sim/drill.toml"));
  EXPECT_EQ(drill->run.ins, "consumer");
  EXPECT_EQ(drill->run.map_cell_m, 0.5);
  EXPECT_NEAR(drill->run.map_turn_rad, radians(5.0), 1e-12);
  ASSERT_EQ(drill->stimuli.size(), 3U);
  EXPECT_EQ(drill->stimuli[1].kind, StimulusKind::kOffset);
  EXPECT_NEAR(drill->stimuli[1].bearing_rad, radians(90.0), 1e-12);
  EXPECT_EQ(drill->stimuli[2].length_s, 15.0);
  EXPECT_EQ(drill->begin_s(), 30.0);
  EXPECT_EQ(drill->end_s(), 85.0);
  EXPECT_EQ(drill->limits.at("ratio"), 1.05);
  EXPECT_EQ(drill->limits.size(), 2U);
}

TEST(DrillSpec, ErrorsNameFileLineKeyAndRange) {
  EXPECT_THAT(complaint(with_stimulus("kind = \"ramp\"\nrate_mps = 500")),
              AllOf(HasSubstr("bad.toml:3"), HasSubstr("rate_mps"), HasSubstr("100")));
  EXPECT_THAT(complaint(with_stimulus("kind = \"magic\"")),
              AllOf(HasSubstr("bad.toml:2"), HasSubstr("kind"), HasSubstr("null_island")));
  EXPECT_THAT(complaint(with_stimulus("begin_s = 3")), HasSubstr("kind"));
  EXPECT_THAT(complaint("[limits]\nbeauty = 1\n"),
              AllOf(HasSubstr("bad.toml:2"), HasSubstr("beauty")));
  EXPECT_THAT(complaint("[limits]\nwithin_protection = 99.9\n"),
              AllOf(HasSubstr("within_protection"), HasSubstr("1")));
  EXPECT_THAT(complaint("[run]\nlength_s = -1\n"), HasSubstr("length_s"));
  EXPECT_THAT(complaint("seeds = 0\n"), HasSubstr("seeds"));
  EXPECT_THAT(complaint("colour = \"red\"\n"), HasSubstr("colour"));
}

TEST(DrillSpec, AKindHasItsOwnKeysOnly) {
  EXPECT_THAT(complaint(with_stimulus("kind = \"dropout\"\noffset_m = 3")), HasSubstr("offset_m"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"offset\"\nrate_mps = 3")), HasSubstr("rate_mps"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"ramp\"\nsource = \"ladar\"")),
              AllOf(HasSubstr("source"), HasSubstr("gps")));
  EXPECT_THAT(complaint(with_stimulus("kind = \"dust\"\nsource = \"gps\"")), HasSubstr("source"));
}

TEST(DrillSpec, AStimulusThatChangesNothingIsAnError) {
  EXPECT_THAT(complaint(with_stimulus("kind = \"offset\"")),
              AllOf(HasSubstr("bad.toml:2"), HasSubstr("changes nothing without offset_m")));
  EXPECT_THAT(complaint(with_stimulus("kind = \"scale\"\nsource = \"ins\"")),
              HasSubstr("gyro_factor or accel_factor"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"bias\"\nsource = \"odometry\"")),
              HasSubstr("speed_mps or yaw_rate_deg"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"axes\"\nsource = \"ins\"")), HasSubstr("axis_x"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"mount\"\nsource = \"ladar\"")),
              HasSubstr("tilt_deg or pan_deg"));
}

TEST(DrillSpec, ASourceThatIsNotClearIsGiven) {
  EXPECT_THAT(complaint(with_stimulus("kind = \"dropout\"")),
              AllOf(HasSubstr("bad.toml"), HasSubstr("source"), HasSubstr("is missing")));
  EXPECT_THAT(complaint(with_stimulus("kind = \"ramp\"\nrate_mps = 1")), HasSubstr("no complaint"));
}

TEST(DrillSpec, AStandardDeviationAndALimitHaveNoSign) {
  EXPECT_THAT(complaint(with_stimulus("kind = \"noise\"\nsource = \"odometry\"\nspeed_mps = -2")),
              AllOf(HasSubstr("bad.toml:4"), HasSubstr("speed_mps"), HasSubstr("0")));
  EXPECT_THAT(complaint(with_stimulus(
                  "kind = \"saturate\"\nsource = \"ins\"\ngyro_dps = [-5.0, 5.0, 5.0]")),
              HasSubstr("gyro_dps"));
  EXPECT_THAT(complaint(with_stimulus("kind = \"bias\"\nsource = \"odometry\"\nspeed_mps = -2")),
              HasSubstr("no complaint"));
}

TEST(DrillSpec, SimulatorOptionsRequireASimulatedRun) {
  EXPECT_THAT(complaint("[run]\nins = \"consumer\"\n"), HasSubstr("needs"));
  EXPECT_THAT(complaint("[run]\nscenario = \"x.toml\"\n"), HasSubstr("needs"));
}

TEST(DrillSpec, WithoutAStimulusTheWholeRunCounts) {
  const Result<Drill> drill = parse_drill("[limits]\nratio = 2.0\n", "none.toml");
  ASSERT_TRUE(drill.ok()) << drill.error().message;
  EXPECT_EQ(drill->begin_s(), 20.0);
  EXPECT_GE(drill->end_s(), 1e5);
  Result<Drill> for_good =
      parse_drill(with_stimulus("kind = \"clock\"\nsource = \"gps\"\njump_s = 1"), "x.toml");
  ASSERT_TRUE(for_good.ok());
  EXPECT_GE(for_good->end_s(), 1e5);
}

TEST(DrillSpec, AFileWithoutStimulusAndLimitsIsNoDrill) {
  EXPECT_EQ(complaint(""), "folder/bad.toml: not a drill: no [[stimulus]] and no [limits]");
}

TEST(DrillSpec, EveryDrillOfTheProjectIsValid) {
  const char* root = std::getenv("RCS_SOURCE_DIR");
  const std::filesystem::path config =
      std::filesystem::path(root == nullptr ? "." : root) / "config";
  for (const auto& entry : std::filesystem::directory_iterator(config / "drills_on_logs")) {
    EXPECT_TRUE(load_drill(entry.path().string()).ok()) << entry.path();
  }
  const std::filesystem::path folder = config / "drills";
  int count = 0;
  double seconds = 0.0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    const Result<Drill> drill = load_drill(entry.path().string());
    ASSERT_TRUE(drill.ok()) << drill.error().message;
    EXPECT_FALSE(drill->about.empty()) << entry.path();
    EXPECT_FALSE(drill->limits.empty()) << entry.path();
    ++count;
    EXPECT_GT(drill->run.length_s, 0.0) << entry.path();
    for (const Stimulus& s : drill->stimuli) EXPECT_LT(s.begin_s, drill->run.length_s);
    const bool exists = drill->run.scenario.empty() || std::filesystem::exists(drill->run.scenario);
    EXPECT_TRUE(exists) << drill->run.scenario;
    if (!drill->full) seconds += drill->run.length_s * drill->seeds;
  }
  EXPECT_GE(count, 70);
  // 140 s of two cores; the limit of --all is 5 minutes.
  EXPECT_LE(seconds, 4400.0) << "--all must be short enough for every day";
}

}  // namespace
}  // namespace rcs::drills
