#pragma once
// Value judgment: costs and speeds for ground, turns and pose uncertainty. Pure functions that BG
// calls when it plans; they make no decisions.

#include <cmath>
#include <cstdint>
#include <vector>

#include "rcs/base/grid.h"

namespace rcs::vj {

/// One cell of terrain as published by WM; heights in the frame of the terrain.
struct Ground {
  bool known = false;
  bool obstacle = false;
  bool vegetation = false;  ///< stands on it and gives way
  float height_m = 0.0F;    ///< NAN: unknown
  float step_m = 0.0F;      ///< of an object or a ledge above the plane of the neighbourhood
  float slope_rad = 0.0F;
  float rise_x = 0.0F;  ///< of the plane along x and y [1]; 0: unknown
  float rise_y = 0.0F;
  float roughness_m = 0.0F;  ///< rms about that plane
  float off_route_m = 0.0F;  ///< distance from the way that the vehicle drives back on
};

/// A rectangle of ground, row by row, x fastest.
struct Terrain {
  double cell_m = 0.4;
  Cell first;
  int width = 0;
  int height = 0;
  std::vector<Ground> ground;

  [[nodiscard]] bool contains(Cell c) const {
    return c.i >= first.i && c.j >= first.j && c.i < first.i + width && c.j < first.j + height;
  }
  [[nodiscard]] std::size_t index(Cell c) const {
    return static_cast<std::size_t>(c.j - first.j) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(c.i - first.i);
  }
  [[nodiscard]] Cell cell_at(double x_m, double y_m) const {
    return {static_cast<int>(std::floor(x_m / cell_m)), static_cast<int>(std::floor(y_m / cell_m))};
  }
  /// Ground outside is unknown.
  [[nodiscard]] Ground at(Cell c) const { return contains(c) ? ground[index(c)] : Ground{}; }
};

struct Weights {
  double slope = 2.0;           ///< added to the cost of a metre at the steepest slope
  double roll = 4.0;            ///< the same at the largest roll
  double roughness = 2.0;       ///< the same at the roughest ground
  double step = 3.0;            ///< the same at the largest step that is not an obstacle
  double unknown = 1.5;         ///< added to the cost of a metre of unknown ground
  double vegetation = 1.0;      ///< the same of ground below tall vegetation
  double off_route = 2.0;       ///< added for each metre from the way that it drives back on
  double nearness = 3.0;        ///< the same in contact with an obstacle
  double near_m = 1.5;          ///< clearance from which obstacles add no cost
  double within_margin = 10.0;  ///< added to the cost of a metre with less clearance than margin_m
  double margin_m = 0.4;
  double max_slope_rad = 0.52;  ///< steeper ground is impassable
  /// Across slopes that roll the vehicle by more it is not driven: 30 deg tip it, and the
  /// suspension and single stones add to the roll of the ground.
  double max_roll_rad = 0.40;
  double max_roughness_m = 0.2;
  double max_step_m = 0.3;
  double reverse = 2.5;     ///< cost of a metre backwards, in metres ahead
  double turn_back = 10.0;  ///< cost of changing direction [m]: it stops and starts again
};

/// Whether the ground may be driven over at all.
[[nodiscard]] bool passable(const Ground& ground, const Weights& weights);

/// Roll of a vehicle with this heading on the plane of the ground [rad], left side up positive; 0
/// if the direction of the slope is unknown.
[[nodiscard]] double roll_on(const Ground& ground, double heading_rad);

/// Added to the cost of a metre for a roll.
[[nodiscard]] double cost_of_roll(double roll_rad, const Weights& weights);

/// Cost of a metre over this ground, at least 1, in metres of easy ground; it must be passable.
/// @param clearance_m  from the body of the vehicle to the nearest obstacle
[[nodiscard]] double cost_per_m(const Ground& ground, double clearance_m, const Weights& weights);

struct SpeedParams {
  double smooth_mps = 10.0;     ///< on level, smooth ground
  double rough_mps = 2.0;       ///< on the roughest or steepest passable ground
  double unknown_mps = 1.5;     ///< where the ground was not seen
  double vegetation_mps = 2.0;  ///< through tall vegetation, which may hide a rock
  double near_mps = 1.5;        ///< in contact with an obstacle
  /// On any ground but mapped roads: from this speed the vehicle stops before a ditch or a drop,
  /// which an edge hides until it is near.
  double sight_mps = 5.0;
  double lateral_mps2 = 2.0;  ///< in turns
  double full_speed_sigma_m =
      0.5;                    ///< horizontal sigma of the pose up to which the speed is not reduced
  double stop_sigma_m = 5.0;  ///< horizontal sigma from which the vehicle does not drive
  double min_speed_share = 0.3;  ///< share of the speed that is left just below that
  /// Protection levels, in the frame of the task, from which the vehicle does not drive to a
  /// waypoint; it slows down from half of them.
  double alert_limit_horizontal_m = 20.0;
  double alert_limit_vertical_m = 20.0;
};

/// What limits a speed; the values are those of plan_point_t.
enum class SpeedCause : std::int8_t {
  kTask,
  kGround,
  kUnknown,
  kVegetation,
  kClearance,
  kTurn,
  kSteering,
  kReverse,
  kSight,
  kZone,
  kUncertainty,
  kEnd
};

struct SpeedLimit {
  double mps = 0.0;
  SpeedCause cause = SpeedCause::kTask;

  /// Becomes the smaller one.
  void lower_to(double other_mps, SpeedCause why) {
    if (other_mps < mps) *this = {other_mps, why};
  }
};

/// Speed that this ground allows: decreases with slope and roughness, and near obstacles.
[[nodiscard]] SpeedLimit speed_on(const Ground& ground, double clearance_m, const Weights& weights,
                                  const SpeedParams& params);

/// Speed that a turn allows [m/s].
[[nodiscard]] double speed_in_turn(double curvature_1pm, const SpeedParams& params);

/// Share of the speed that the uncertainty of the pose allows; 0: too uncertain to drive.
/// @param sigma_m  the larger horizontal sigma of the pose in the frame of the command
[[nodiscard]] double speed_share(double sigma_m, const SpeedParams& params);

/// Share of the speed that the protection levels [m] allow against their alert limits; 0: beyond
/// one of them.
[[nodiscard]] double protected_share(double horizontal_m, double vertical_m,
                                     const SpeedParams& params);

}  // namespace rcs::vj
