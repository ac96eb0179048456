// What the vehicle must not drive over, and what it must: a vehicle approaches ground of each kind
// and size and stops before the first impassable cell ahead. The limits are those of
// sim/vehicle/contact.h, the LADAR is the one of imager.h.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "modules/bg/hidden_ground.h"
#include "modules/vj/traversal_cost.h"
#include "modules/wm/terrain/ledge.h"
#include "modules/wm/terrain/obstacle_sides.h"
#include "modules/wm/terrain/terrain_grid.h"
#include "sim/vehicle/contact.h"
#include "tests/wm/imager.h"

namespace rcs::bg {
namespace {

using Ground = std::function<double(double x_m)>;

constexpr double kFront_m = 1.6;  // from the origin of the vehicle
// From the front to where a front wheel meets an edge, see sim/vehicle/contact.h.
constexpr double kWheelEdge_m = 0.45;
constexpr double kStep_m = 0.3;  // between scans

/// Along x from -15 m, straight on, one scan every kStep_m.
struct Approach {
  double detected_m = 0.0;  ///< distance of the LADAR from x = 0 at the first impassable cell ahead
  double stopped_m = 1e3;   ///< the front, when it stood before an impassable cell; 1e3: it did not
};

/// Range along a ray to the ground, up to 25 m.
std::optional<double> range_to(const Ground& ground, const Vec3& from, const Vec3& along) {
  constexpr double kMarch_m = 0.1;
  const auto below = [&](double range_m) {
    const Vec3 p = from + range_m * along;
    return p.z() <= ground(p.x());
  };
  double outside_m = 1.0;
  while (outside_m < 25.0 && !below(outside_m + kMarch_m)) outside_m += kMarch_m;
  if (outside_m >= 25.0) return std::nullopt;
  double inside_m = outside_m + kMarch_m;
  for (int k = 0; k < 5; ++k) {
    const double middle_m = 0.5 * (outside_m + inside_m);
    (below(middle_m) ? inside_m : outside_m) = middle_m;
  }
  return inside_m;
}

Approach approach(const Ground& ground, double end_m, double begin_m) {
  wm::TerrainParams params;
  params.edge_range_m = 10.0;
  params.p_vehicle_ladar = wm::kImager;
  wm::TerrainGrid grid(params);
  const vj::Weights weights;
  SightParams sight;
  sight.far_m = 9.0;
  sight.ahead_m = wm::kImager.x();
  HiddenGround hidden(sight);
  std::vector<wm::TerrainAnswer> answers;
  vj::Terrain terrain;
  terrain.cell_m = params.cell_m;
  terrain.width = terrain.height = params.patch;
  std::mt19937 rng(1);
  Approach out;
  for (double x = begin_m; x + kFront_m < end_m; x += kStep_m) {
    // The wheels are 1 m before and behind the origin.
    const double front = ground(x + 1.0);
    const double rear = ground(x - 1.0);
    const double pitch = std::atan2(front - rear, 2.0);
    const Pose T{Quat(Eigen::AngleAxisd(-pitch, Vec3::UnitY())),
                 Vec3(x, 0.0, 0.5 * (front + rear) + 0.9)};
    const wm::RangeAlong ray = [&ground](const Vec3& from, const Vec3& along) {
      return range_to(ground, from, along);
    };
    grid.insert(wm::imager_scan(T, ray, &rng), T);
    terrain.first = grid.patch(T, &answers);
    wm::join_sides(params.patch, params.side_m, &answers);
    terrain.ground.resize(answers.size());
    for (std::size_t k = 0; k < answers.size(); ++k) {
      vj::Ground& g = terrain.ground[k];
      g = {};
      g.known = answers[k].known;
      g.obstacle = answers[k].obstacle;
      g.slope_rad = answers[k].slope_rad;
    }
    hidden.mark({x, 0.0, 0.0, 0.0}, pitch, 0.0, true, &terrain);
    double nearest_m = 1e3;
    for (int j = -3; j < 3; ++j) {  // 1.2 m to either side
      for (int i = terrain.cell_at(x + kFront_m, 0.0).i; i < terrain.first.i + params.patch; ++i) {
        if (vj::passable(terrain.at({i, j}), weights)) continue;
        nearest_m = std::min(nearest_m, params.cell_m * i);
        break;
      }
    }
    if (nearest_m < 1e3 && out.detected_m == 0.0) out.detected_m = -(x + wm::kImager.x());
    if (nearest_m < x + kFront_m + kStep_m + Shape{}.min_margin_m) {
      out.stopped_m = x + kFront_m;
      return out;
    }
  }
  return out;
}

/// Of height_m within width_m; negative: a drop.
Ground step(double height_m, double width_m) {
  return [=](double x) { return height_m * std::clamp(x / width_m, 0.0, 1.0); };
}
Ground ditch(double width_m, double depth_m) {
  return [=](double x) {
    const double inside = 0.5 * width_m - std::abs(x - 0.5 * width_m);
    return -depth_m * std::clamp(inside / std::min(0.35 * depth_m, 0.5 * width_m), 0.0, 1.0);
  };
}
Ground slope(double rad) {
  return [=](double x) { return std::max(0.0, x) * std::tan(rad); };
}

struct Row {
  std::string what;
  Ground ground;
  double end_m;          ///< of the hazard
  bool drivable;         ///< within the limits of the vehicle; else beyond
  double min_mps = 5.0;  ///< from which it must stop, braking with 5 m/s2
  double edge_m = 0.0;   ///< where no front wheel must be
};

/// Largest speed from which the vehicle stops before a hazard that is detected at this distance of
/// the LADAR: 0.45 s for the map and the brakes, 0.9 m to the front and a margin.
double speed_mps(double detected_m, double braking_mps2) {
  constexpr double kDelay_s = 0.45;
  const double free_m = std::max(0.0, detected_m - 0.9);
  const double lost_mps = braking_mps2 * kDelay_s;
  return std::sqrt(lost_mps * lost_mps + 2.0 * braking_mps2 * free_m) - lost_mps;
}

void check(const std::vector<Row>& rows) {
  for (const Row& row : rows) {
    Approach worst{1e3, -1e3};
    for (const double begin_m : {-15.0, -15.1, -15.2}) {
      const Approach a = approach(row.ground, row.end_m + 3.0, begin_m);
      if (row.drivable) {
        EXPECT_EQ(a.stopped_m, 1e3) << row.what << " can be driven over";
        continue;
      }
      worst.detected_m = std::min(worst.detected_m, a.detected_m);
      worst.stopped_m = std::max(worst.stopped_m, a.stopped_m);
    }
    if (row.drivable) continue;
    std::printf("%-30s detected at %4.1f m: stops from %.1f m/s (1.5 m/s2), %.1f m/s (5 m/s2)\n",
                row.what.c_str(), worst.detected_m, speed_mps(worst.detected_m, 1.5),
                speed_mps(worst.detected_m, 5.0));
    EXPECT_LT(worst.stopped_m - kWheelEdge_m, row.edge_m) << row.what;
    EXPECT_GE(speed_mps(worst.detected_m, 5.0), row.min_mps) << row.what;
  }
}

TEST(Ledge, TableOfProfiles) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  struct ProfileRow {
    const char* what;
    wm::Profile z_m;
    double rise_m;
    double ledge_m;
  };
  const std::vector<ProfileRow> rows = {
      {"level", {0, 0, 0, 0, 0}, 0, 0},
      {"uniform slope", {0, 0.2F, 0.4F, 0.6F, 0.8F}, 0.2, 0},
      {"crest", {0, 0.2F, 0.4F, 0.4F, 0.4F}, 0.1, 0},
      {"foot of a slope", {0, 0, 0, 0.2F, 0.4F}, 0.1, 0},
      {"foot of a slope, in front of the cell", {0, 0, 0.2F, 0.4F, 0.6F}, 0.1, 0},
      {"ledge behind the cell", {0, 0, 0, 0.5F, 0.5F}, 0.1, 0.5},
      {"ledge before the cell", {0, 0, 0.5F, 0.5F, 0.5F}, 0.1, 0.5},
      {"drop behind the cell", {0, 0, 0, -0.5F, -0.5F}, -0.1, 0.5},
      {"ledge across the cell", {0, 0, 0.25F, 0.5F, 0.5F}, 0.1, 0.5},
      {"ledge in a slope", {0, 0.1F, 0.2F, 0.7F, 0.8F}, 0.2, 0.4},
      {"drop in a slope up", {0, 0.1F, 0.2F, -0.2F, -0.1F}, 0.0, 0.4},
      {"nothing known behind a ledge", {0, 0, 0, 0.5F, kNone}, 0.1, 0.5},
      {"no slope known: that of the plane", {kNone, kNone, 0, 0.5F, kNone}, 0.2, 0.3},
      {"alone", {kNone, kNone, 0, kNone, kNone}, 0.2, 0},
      {"a stone", {0, 0, 0.3F, 0, 0}, 0, 0.3},
  };
  for (const ProfileRow& row : rows) {
    EXPECT_NEAR(wm::ledge_height(row.z_m, row.rise_m), row.ledge_m, 1e-6) << row.what;
  }
}

TEST(DrivableLimits, ThoseOfThePlannerAreWithinThoseOfTheVehicle) {
  const sim::PassableLimits vehicle;
  const vj::Weights weights;
  const wm::TerrainParams terrain;
  EXPECT_LE(terrain.ledge_m, vehicle.step_m - 0.05);
  EXPECT_LE(terrain.obstacle_m, vehicle.belly_m);
  EXPECT_LE(weights.max_slope_rad, vehicle.pitch_rad - radians(5.0));
  EXPECT_LE(weights.max_roll_rad, vehicle.roll_rad - radians(5.0));
}

TEST(DrivableLimits, Ledges) {
  check({{"ledge 0.15 m", step(0.15, 0.1), 1.0, true},
         {"ledge 0.4 m", step(0.4, 0.1), 1.0, false},
         {"ledge 0.4 m in 0.3 m", step(0.4, 0.3), 1.0, false},
         {"ledge 0.5 m", step(0.5, 0.1), 1.0, false},
         {"ledge 0.6 m in 0.4 m", step(0.6, 0.4), 1.0, false},
         {"ledge 1 m", step(1.0, 0.1), 1.0, false}});
}

TEST(DrivableLimits, Drops) {
  check({{"drop 0.1 m", step(-0.1, 0.1), 1.0, true},
         {"drop 0.4 m", step(-0.4, 0.1), 1.0, false},
         {"drop 0.4 m in 0.3 m", step(-0.4, 0.3), 1.0, false},
         {"drop 0.5 m", step(-0.5, 0.1), 1.0, false},
         {"drop 0.6 m in 0.4 m", step(-0.6, 0.4), 1.0, false},
         {"drop 1 m", step(-1.0, 0.1), 1.0, false},
         {"drop 4 m", step(-4.0, 0.1), 1.0, false}});
}

TEST(DrivableLimits, Ditches) {
  check({{"ditch 0.5 m wide, 0.15 m deep", ditch(0.5, 0.15), 0.5, true},
         {"ditch 0.6 m wide, 0.4 m deep", ditch(0.6, 0.4), 0.6, false, 4.0},
         {"ditch 0.6 m wide, 0.8 m deep", ditch(0.6, 0.8), 0.6, false, 4.0},
         {"ditch 0.8 m wide, 0.5 m deep", ditch(0.8, 0.5), 0.8, false},
         {"ditch 1 m wide, 0.5 m deep", ditch(1.0, 0.5), 1.0, false},
         {"ditch 1 m wide, 1 m deep", ditch(1.0, 1.0), 1.0, false},
         {"ditch 2.5 m wide, 1.5 m deep", ditch(2.5, 1.5), 2.5, false}});
}

TEST(DrivableLimits, Slopes) {
  check({{"slope of 20 deg", slope(radians(20.0)), 3.0, true},
         {"slope of 25 deg", slope(radians(25.0)), 3.0, true},
         // The front may stand on it: the front wheels are 0.6 m behind.
         {"slope of 36 deg", slope(radians(36.0)), 3.0, false, 5.0, 0.5}});
}

}  // namespace
}  // namespace rcs::bg
