#include "tools/evaluation/driving_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "rcs/node/log/log_file.h"
#include "tests/support/fresh_folder.h"

namespace rcs::evaluation {
namespace {

class DrivingPlot : public testing::Test {
 protected:
  template <class M>
  void write(const char* channel, const M& m) {
    std::vector<std::uint8_t> data(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(data.data(), 0, static_cast<int>(data.size()));
    ASSERT_TRUE(writer_.write(from_utime(m.utime), channel, data.data(), data.size()));
  }
  void drive(int seconds) {
    for (int k = 0; k < seconds; ++k) {
      nav_state_t nav{};
      nav.utime = std::int64_t{1'000'000} * (k + 1);
      nav.local_utime = 1;
      nav.q_local_vehicle[0] = nav.q_world_vehicle[0] = 1.0;
      nav.p_local_vehicle_m[0] = k;
      write(channel::kWmNavState, nav);
    }
  }
  /// Three cells, of which the second and the third are obstacles or not.
  void see(std::int64_t utime, std::uint8_t second, std::uint8_t third) {
    map_patch_t patch{};
    patch.utime = utime;
    patch.local_utime = 1;
    patch.cell_m = 0.4;
    patch.width = patch.n = 3;
    patch.height = 1;
    patch.height_cm.assign(3, 0);
    patch.step_cm = {0, 30, 250};
    patch.slope_deg.assign(3, 0);
    patch.roughness_cm.assign(3, 0);
    patch.flags = {0, second, third};
    write(channel::kWmMapPatch, patch);
  }
  void plan() {
    plan_t plan{};
    plan.utime = 3'000'000;
    plan.n = 2;
    plan.point.resize(2);
    plan.point[1].p_m[0] = 5.0;
    write(channel::kBgPlan, plan);
  }
  std::optional<DrivingRecord> record() {
    EXPECT_TRUE(writer_.close());
    Result<std::optional<DrivingRecord>> read = driving_record(path_);
    EXPECT_TRUE(read.ok());
    return read.ok() ? std::move(read).value() : std::nullopt;
  }
  std::optional<report::Plot> plot() {
    std::optional<DrivingRecord> drive = record();
    return drive ? std::optional<report::Plot>(std::move(drive->plot)) : std::nullopt;
  }

  std::string path_ = (test::fresh_folder() / "drive.log").string();
  LogWriter writer_ = LogWriter::create(path_).value();
};

TEST_F(DrivingPlot, HasCoursePathLevelAndTheObstaclesThatRemain) {
  integrity_t level{};
  level.utime = 1;
  level.protection_horizontal_m = 2.0;
  write(channel::kWmIntegrity, level);
  drive(20);
  see(21'000'000, map_patch_t::FLAG_OBSTACLE, map_patch_t::FLAG_OBSTACLE);
  see(22'000'000, 0, map_patch_t::FLAG_OBSTACLE);
  plan();
  const std::optional<report::Plot> p = plot();
  ASSERT_TRUE(p);
  ASSERT_EQ(p->series.size(), 3U);
  EXPECT_EQ(p->series[0].label, "paths of BG, one a second");
  EXPECT_EQ(p->series[2].x.size(), 20U);
  ASSERT_EQ(p->map->cells.size(), 1U);
  EXPECT_EQ(p->map->cells[0].i, 2);
  EXPECT_EQ(p->map->cells[0].value, 1.0) << "the scale ends there";
  EXPECT_EQ(report::render(*p, true).find("nan"), std::string::npos);
}

TEST_F(DrivingPlot, HasTheRoutesOfTheMission) {
  drive(20);
  plan();
  routes_t routes{};
  routes.utime = 21'000'000;
  routes.route.resize(2);
  routes.n = 2;
  for (route_t& r : routes.route) {
    r.verdict = route_t::VERDICT_ABOVE_LIMIT;
    r.x_m = {0.0, 20.0};
    r.y_m = {0.0, 90.0};
    r.n = 2;
  }
  routes.route[1].verdict = route_t::VERDICT_CHOSEN;
  write(channel::kMissionRoutes, routes);
  const std::optional<DrivingRecord> d = record();
  ASSERT_TRUE(d);
  ASSERT_EQ(d->choices.size(), 1U);
  const auto has = [&d](const char* label) {
    return std::any_of(d->plot.series.begin(), d->plot.series.end(),
                       [label](const report::Series& s) { return s.label == label; });
  };
  EXPECT_TRUE(has("chosen routes"));
  EXPECT_TRUE(has("other routes"));
  EXPECT_GE(d->plot.window->y_high, 90.0) << "the routes are in view";
}

TEST_F(DrivingPlot, ALogWithoutAPlanHasNone) {
  drive(20);
  EXPECT_FALSE(plot());
}

TEST_F(DrivingPlot, AFileThatIsMissingIsAnError) { EXPECT_FALSE(driving_record("none.log").ok()); }

}  // namespace
}  // namespace rcs::evaluation
