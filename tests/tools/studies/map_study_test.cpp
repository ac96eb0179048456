#include "tools/studies/map_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace rcs::studies {
namespace {

using ::testing::HasSubstr;

constexpr double kEnd_s = 100.0;

Stamp at(double t_s) { return Stamp(from_seconds(1000.0 + t_s)); }

// A drive east at 10 m/s with ten beliefs a second that have the error `error`.
drills::DrillRecord drive(const Vec3& error, double sigma_m) {
  drills::DrillRecord record;
  record.begin = at(0.0);
  record.end = at(kEnd_s);
  for (int k = 0; k <= 1000; ++k) {
    const double t_s = 0.1 * k;
    Pose T;
    T.p = Vec3(10.0 * t_s, 0.0, 0.0);
    record.truth.push_back({at(t_s), T});
    drills::DrillBelief belief;
    belief.stamp = at(t_s);
    belief.T_world_vehicle = T;
    belief.T_world_vehicle.p += error;
    belief.cov_world_pose = Mat6::Identity() * sigma_m * sigma_m;
    record.beliefs.push_back(belief);
  }
  return record;
}

MapStudyBlock block(std::optional<double> cell_m, const std::vector<drills::DrillRecord>& records) {
  const MapStudyPlan plan;
  MapStudyBlock b{"hills.toml", cell_m, {}, {}};
  for (const drills::DrillRecord& record : records) b.runs.push_back(map_study_run(plan, record));
  return b;
}

TEST(MapStudy, SamplesTheErrorOnceASecondFromTheLossOfGps) {
  const MapStudyRun run = map_study_run({}, drive({3.0, 0.0, 4.0}, 2.0));
  EXPECT_EQ(run.error_m.size(), 64U);  // 36 s to 99 s
  EXPECT_NEAR(run.error_m.front(), 5.0, 1e-9);
  EXPECT_NEAR(run.horizontal_m.front(), 3.0, 1e-9);
  EXPECT_EQ(run.inside, 64U);  // 6.25 of chi-square with 3 degrees
  EXPECT_EQ(run.missing, 0U);
  EXPECT_NEAR(run.driven_m, 650.0, 1.0);
}

TEST(MapStudy, SecondsWithoutABeliefAreCounted) {
  drills::DrillRecord record = drive(Vec3::Zero(), 1.0);
  record.beliefs.resize(600);  // silent from 60 s on
  const MapStudyRun run = map_study_run({}, record);
  EXPECT_EQ(run.error_m.size(), 25U);
  EXPECT_EQ(run.missing, 39U);
}

TEST(MapStudy, TheRatioComparesTheRmsOverAllDrives) {
  const std::vector<MapStudyBlock> blocks = {
      block(std::nullopt, {drive({4.0, 0.0, 0.0}, 1.0), drive({0.0, 2.0, 0.0}, 1.0)}),
      block(5.0, {drive({1.0, 0.0, 0.0}, 1.0), drive({0.0, 1.0, 0.0}, 1.0)})};
  const nlohmann::ordered_json json = map_study_json(blocks)["rows"];
  EXPECT_TRUE(json[0]["map_cell_m"].is_null());
  EXPECT_TRUE(json[0]["ratio_to_no_map"].is_null());
  EXPECT_NEAR(json[0]["error_rms_m"], std::sqrt(10.0), 1e-9);
  EXPECT_NEAR(json[0]["inside_95"], 0.5, 1e-9);
  EXPECT_NEAR(json[1]["ratio_to_no_map"], 1.0 / std::sqrt(10.0), 1e-9);
  EXPECT_THAT(to_text(map_study_table(blocks)), HasSubstr("0.316"));
}

TEST(MapStudy, TheRatioHasAFloorForSmallErrors) {
  const std::vector<MapStudyBlock> blocks = {block(std::nullopt, {drive({0.01, 0.0, 0.0}, 1.0)}),
                                             block(5.0, {drive({0.1, 0.0, 0.0}, 1.0)})};
  EXPECT_NEAR(map_study_json(blocks)["rows"][1]["ratio_to_no_map"], 0.5, 1e-9);
}

TEST(MapStudy, AFailedDriveIsReportedInItsRow) {
  MapStudyBlock failed{"hills.toml", 5.0, {}, "no course"};
  const nlohmann::ordered_json json = map_study_json({failed})["rows"];
  EXPECT_EQ(json[0]["error"], "no course");
  EXPECT_THAT(map_study_svg({block(0.5, {drive({1.0, 0.0, 0.0}, 1.0)}), failed}),
              HasSubstr("hills"));
}

}  // namespace
}  // namespace rcs::studies
