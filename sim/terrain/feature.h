#pragma once
// Features of the ground that a scenario places: what a vehicle must not drive over or against.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::sim {

/// Along the line from `a` to `b`. Left is as seen along the line.
struct Feature {
  enum class Kind {
    kStep,   ///< the ground on the left is higher by height_m (lower: a drop) within width_m
    kDitch,  ///< height_m deep, width_m between its upper edges
    kWall    ///< height_m high, width_m thick
  };
  Kind kind = Kind::kStep;
  Vec2 a_world = Vec2::Zero();
  Vec2 b_world = Vec2::Zero();
  double height_m = 1.0;  ///< of a step: negative for a drop; else positive
  double width_m = 0.3;
  double extent_m = 8.0;  ///< of a step: of the level ground on the left, before it returns gently
};

/// Height that the features add to the ground [m].
[[nodiscard]] double feature_height(const std::vector<Feature>& features, double x_m, double y_m);

/// Hazards across the legs of a course, one a leg, drawn by seed.
struct HazardParams {
  /// drop, ledge, ditch, wall, bank; low_drop, low_ledge, small_ditch, slope: around the limits of
  /// the vehicle; gate: a wall with a gap of 4 to 5.5 m on the leg; dead_end:
  /// three walls around 8 to 14 m by depth_max_m or less, open towards the start of the leg; pen:
  /// four walls around the end of the leg, to which no way leads
  std::vector<std::string> kinds;
  double depth_max_m = 50.0;
  double length_min_m = 10.0;  ///< of the line across the leg
  double length_max_m = 30.0;
  double turn_rad = radians(30.0);  ///< largest, from straight across
};

/// @return an unknown kind: its name; empty: all are known
[[nodiscard]] std::string unknown_hazard(const std::vector<std::string>& kinds);

/// The middle of each leg, and a place beside it, lie within the line: there is a way around one of
/// its ends, but for a pen.
[[nodiscard]] std::vector<Feature> draw_hazards(const HazardParams& params,
                                                const std::vector<Vec2>& waypoints_world,
                                                std::uint64_t seed);

}  // namespace rcs::sim
