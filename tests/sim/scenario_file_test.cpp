#include "sim/scenario_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace rcs::sim {
namespace {

std::string shipped(const std::string& name) {
  const char* const root = std::getenv("RCS_SOURCE_DIR");
  return std::string(root != nullptr ? root : ".") + "/config/sim/" + name;
}

/// reference.toml with one text replaced by another, next to the shipped INS grades.
class ChangedReference {
 public:
  ChangedReference(const std::string& from, const std::string& to) {
    // One for each test: tests run in parallel.
    dir_ = testing::TempDir() + "rcs_scenario_file_test_" +
           testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(dir_);
    std::filesystem::copy_file(shipped("ins_grades.toml"), dir_ + "/ins_grades.toml",
                               std::filesystem::copy_options::overwrite_existing);
    std::ifstream in(shipped("reference.toml"));
    std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    std::ofstream(path()) << text;
  }
  ~ChangedReference() { std::filesystem::remove_all(dir_); }
  [[nodiscard]] std::string path() const { return dir_ + "/changed.toml"; }

 private:
  std::string dir_;
};

TEST(ScenarioFile, ShippedScenariosLoad) {
  for (const char* name : {"reference.toml", "tilt_sweep.toml", "demo.toml", "spinning64.toml"}) {
    const Result<Scenario> s = load_scenario(shipped(name), {});
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_GE(s->course.waypoints_world.size(), 20U);
  }
}

// The values that mission.md specifies.
TEST(ScenarioFile, TheReferenceScenarioIsAsSpecified) {
  const Result<Scenario> s = load_scenario(shipped("reference.toml"), {});
  ASSERT_TRUE(s) << s.error().message;
  EXPECT_EQ(s->imager.rows, 32);
  EXPECT_EQ(s->imager.cols, 180);
  EXPECT_EQ(s->imager.facets, 16);
  EXPECT_DOUBLE_EQ(s->imager.fov_v_rad, radians(20.0));
  EXPECT_DOUBLE_EQ(s->imager.fov_h_rad, radians(90.0));
  EXPECT_EQ(s->imager.period_s, 0.1);
  EXPECT_DOUBLE_EQ(s->imager.tilt_rad, radians(-10.0));
  EXPECT_EQ(s->imager.sweep_rad, 0.0);
  EXPECT_EQ(s->beam.max_range_m, 60.0);
  EXPECT_EQ(s->beam.sigma_m, 0.03);
  EXPECT_EQ(s->beam.missing_share, 0.15);
  EXPECT_NEAR(s->mount.T_vehicle_mount.p.z() + s->vehicle.imu_height_m, 1.8, 1e-12);
  EXPECT_EQ(s->mount.error_m, 0.01);
  EXPECT_DOUBLE_EQ(s->mount.error_rad, radians(0.2));
  EXPECT_DOUBLE_EQ(s->ladar_clock_offset_s, 0.005);
  EXPECT_EQ(s->gps.sigma_m, 0.3);
  EXPECT_EQ(s->gps.correlation_s, 60.0);
  EXPECT_TRUE(s->gps.outages.empty());
  EXPECT_DOUBLE_EQ(s->ins.scale_error, 300e-6);
  EXPECT_DOUBLE_EQ(s->ins.misalignment_rad, radians(0.1));
  EXPECT_NEAR(s->ins.grade.gyro_walk_radprs, radians(0.15) / 60.0, 1e-12);
  EXPECT_NEAR(s->course.speed_mps, 35.0 / 3.6, 1e-12);
  EXPECT_EQ(s->course.rest_s, 3.0);
}

TEST(ScenarioFile, OverridesTakePrecedence) {
  ScenarioOverrides overrides;
  overrides.seed = 77;
  overrides.ins_grade = "consumer";
  overrides.gps_outage = Outage{20.0, 30.0};
  overrides.duration_s = 12.0;
  const Result<Scenario> s = load_scenario(shipped("demo.toml"), overrides);
  ASSERT_TRUE(s) << s.error().message;
  EXPECT_EQ(s->seed, 77U);
  EXPECT_EQ(s->world.seed, 1U);
  EXPECT_EQ(s->ins.grade_name, "consumer");
  ASSERT_EQ(s->gps.outages.size(), 1U);
  EXPECT_EQ(s->gps.outages[0].length_s, 30.0);
  EXPECT_EQ(s->duration_s, 12.0);

  const ChangedReference follows("seed_follows = false", "seed_follows = true");
  const Result<Scenario> f = load_scenario(follows.path(), overrides);
  ASSERT_TRUE(f) << f.error().message;
  EXPECT_EQ(f->world.seed, 77U);
}

TEST(ScenarioFile, AFileBasedOnAnotherListsOnlyDifferences) {
  const ChangedReference reference("seed = ", "seed = ");
  const auto derived = [&](const std::string& name, const std::string& text) {
    std::string path = reference.path().substr(0, reference.path().rfind('/')) + "/" + name;
    std::ofstream(path) << text;
    return path;
  };
  const std::string path =
      derived("one.toml",
              "based_on = \"changed.toml\"\n"
              "[course]\nwaypoint = [{ x_m = 1, y_m = 2 }, { x_m = 9, y_m = 2 }]\n"
              "[ladar]\nkind = \"spinning\"\n"
              "[gps]\noutage = [{ begin_s = 5.0, length_s = 6.0 }]\n");
  const std::string second =
      derived("two.toml", "based_on = \"one.toml\"\nseed = 9\n[gps]\noutage = []\n");
  const Result<Scenario> base = load_scenario(reference.path(), {});
  const Result<Scenario> s = load_scenario(path, {});
  const Result<Scenario> t = load_scenario(second, {});
  ASSERT_TRUE(base && s && t) << (s ? t ? "" : t.error().message : s.error().message);
  EXPECT_EQ(s->ladar, LadarKind::kSpinning);
  EXPECT_EQ(s->course.waypoints_world, (std::vector<Vec2>{{1.0, 2.0}, {9.0, 2.0}}));
  EXPECT_EQ(s->gps.outages.size(), 1U);
  EXPECT_EQ(s->beam.sigma_m, base->beam.sigma_m);
  EXPECT_EQ(s->ins.grade.gyro_walk_radprs, base->ins.grade.gyro_walk_radprs);
  EXPECT_EQ(s->world.octaves.size(), base->world.octaves.size());
  EXPECT_EQ(t->seed, 9U);
  EXPECT_TRUE(t->gps.outages.empty());
  EXPECT_EQ(t->ladar, LadarKind::kSpinning);
  EXPECT_EQ(t->course.waypoints_world.size(), 2U);

  const Result<Scenario> circle =
      load_scenario(derived("circle.toml", "based_on = \"circle.toml\"\n"), {});
  ASSERT_FALSE(circle);
  EXPECT_NE(circle.error().message.find("circle.toml: based_on"), std::string::npos);
  const Result<Scenario> orphan =
      load_scenario(derived("orphan.toml", "based_on = \"gone.toml\"\n"), {});
  ASSERT_FALSE(orphan);
  EXPECT_NE(orphan.error().message.find("gone.toml"), std::string::npos);
}

TEST(ScenarioFile, MovingActorsAreReadAndDrawn) {
  const auto with = [](const std::string& text) {
    const ChangedReference file("[vehicle]", text + "\n[vehicle]");
    return load_scenario(file.path(), {});
  };
  const std::string walker =
      "[[actor]]\nkind = \"vehicle\"\nspeed_mps = 3\nstart_s = 7\nwithin_m = 25\n"
      "waypoint = [{ x_m = 1, y_m = 2 }, { x_m = 9, y_m = 2 }]";
  const Result<Scenario> s = with(walker);
  ASSERT_TRUE(s) << s.error().message;
  ASSERT_EQ(s->actors.size(), 1U);
  EXPECT_EQ(s->actors[0].kind, ActorKind::kVehicle);
  EXPECT_EQ(s->actors[0].waypoints_world, (std::vector<Vec2>{{1.0, 2.0}, {9.0, 2.0}}));
  EXPECT_EQ(s->actors[0].speed_mps, 3.0);
  EXPECT_EQ(s->actors[0].start_s, 7.0);
  EXPECT_EQ(s->actors[0].within_m, 25.0);
  const Result<Scenario> drawn = with(walker + "\n[actors]\nkinds = [\"crossing\"]");
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_GT(drawn->actors.size(), 1U);
  EXPECT_TRUE(load_scenario(shipped("closed_loop.toml"), {})->actors.empty());
  EXPECT_FALSE(load_scenario(shipped("actors.toml"), {})->actors.empty());

  const Result<Scenario> unknown = with("[actors]\nkinds = [\"dancing\"]");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("dancing"), std::string::npos);
  const Result<Scenario> still = with("[[actor]]\nwaypoint = [{ x_m = 1, y_m = 2 }]");
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().message.find("waypoint"), std::string::npos);
}

TEST(ScenarioFile, ErrorsAreNamed) {
  const auto complaint = [](const std::string& from, const std::string& to) {
    const ChangedReference file(from, to);
    const Result<Scenario> s = load_scenario(file.path(), {});
    return s ? std::string("accepted") : s.error().message;
  };
  EXPECT_NE(complaint("tilt_deg = -10", "titl_deg = -10").find("titl_deg"), std::string::npos);
  EXPECT_NE(complaint("sigma_m = 0.03", "sigma_m = -1").find("sigma_m"), std::string::npos);
  EXPECT_NE(complaint("facets = 16", "facets = 5").find("facets"), std::string::npos);
  EXPECT_NE(complaint("\"tactical\"", "\"marine\"").find("marine"), std::string::npos);
  EXPECT_NE(complaint("{ x_m = 60, y_m = 0 }", "{ x_m = 0, y_m = 0 }").find("waypoint"),
            std::string::npos);
  EXPECT_NE(complaint("clear_m = 2.5", "clear_m = 2.5\ndem = \"nowhere.asc\"").find("nowhere.asc"),
            std::string::npos);
  EXPECT_NE(complaint("[vehicle]", "[drive]\nmode = \"commanded\"\n[vehicle]").find("duration_s"),
            std::string::npos);
  EXPECT_NE(complaint("rest_s = 3.0", "rest_s = 3.0\nrandom = { count = 3 }").find("waypoints"),
            std::string::npos);
  EXPECT_FALSE(load_scenario("/nonexistent.toml", {}));
}

TEST(ScenarioFile, RandomWaypointsDependOnTheSeed) {
  const auto waypoints = [](std::int64_t seed) {
    ScenarioOverrides overrides;
    overrides.seed = seed;
    const Result<Scenario> s = load_scenario(shipped("closed_loop.toml"), overrides);
    EXPECT_TRUE(s) << s.error().message;
    EXPECT_TRUE(s->commanded);
    EXPECT_EQ(s->world.seed, static_cast<std::uint64_t>(seed));
    EXPECT_NEAR(s->course.speed_mps, 6.0, 1e-9);
    return s->course.waypoints_world;
  };
  const std::vector<Vec2> w = waypoints(5);
  EXPECT_EQ(w, waypoints(5));
  EXPECT_NE(w, waypoints(6));
  ASSERT_EQ(w.size(), 6U);
  EXPECT_EQ(w[0], Vec2(0.0, 0.0));
  for (std::size_t k = 1; k < w.size(); ++k) {
    const Vec2 leg = w[k] - w[k - 1];
    EXPECT_GE(leg.norm(), 35.0);
    EXPECT_LE(leg.norm(), 55.0);
    if (k == 1) continue;
    const Vec2 before = w[k - 1] - w[k - 2];
    const double turn = std::atan2(before.x() * leg.y() - before.y() * leg.x(), before.dot(leg));
    EXPECT_LE(std::abs(turn), radians(60.0) + 1e-9);
  }
}

}  // namespace
}  // namespace rcs::sim
