#include "tools/evaluation/driving_plot.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
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
  std::optional<report::Plot> plot() {
    EXPECT_TRUE(writer_.close());
    Result<std::optional<report::Plot>> read = driving_plot(path_);
    EXPECT_TRUE(read.ok());
    return read.ok() ? std::move(read).value() : std::nullopt;
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

TEST_F(DrivingPlot, ALogWithoutAPlanHasNone) {
  drive(20);
  EXPECT_FALSE(plot());
}

TEST_F(DrivingPlot, AFileThatIsMissingIsAnError) { EXPECT_FALSE(driving_plot("none.log").ok()); }

}  // namespace
}  // namespace rcs::evaluation
