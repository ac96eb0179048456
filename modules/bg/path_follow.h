#pragma once
// From a path to the current drive command: speed at each of its points, and steering along it.

#include "modules/bg/body.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

struct FollowParams {
  double braking_mps2 = 1.5;  ///< deceleration assumed by the planned speeds
  double lookahead_s = 0.8;   ///< driving time to the point that pure pursuit steers to
  double lookahead_min_m = 2.0;
  double latency_s = 0.25;  ///< of the steering
  double firm_mps2 = 2.5;   ///< BG commands the brake for an obstacle that needs more
  double keep_cost =
      1.15;              ///< factor by which a new path must be cheaper to replace the current one
  double keep_m = 10.0;  ///< remaining length of path above which that applies
  double max_lateral_deviation_m = 1.0;  ///< from the path; beyond it a new path is needed
};

/// Sets limit_mps, speed_mps and cause: limits by ground, turns and obstacles (vj), and by braking
/// to a stop at the end of the path and wherever it changes direction.
/// @param terrain  in the frame of the path
/// @param max_mps  limit independent of the ground
/// @param share  of the speed, (0, 1], by the uncertainty of the pose
void plan_speeds(const vj::Terrain& terrain, const vj::Weights& weights,
                 const vj::SpeedParams& speeds, const FollowParams& params, const Shape& shape,
                 double max_mps, double share, Path* path);

/// Distance to stop.
[[nodiscard]] double stopping_m(double speed_mps, const FollowParams& params);

/// Largest speed from which the vehicle stops within `free_m`.
[[nodiscard]] double speed_within(double free_m, double speed_mps, const FollowParams& params);

/// Whether stopping within `free_m` needs the brake: more than firm_mps2.
[[nodiscard]] bool must_brake(double free_m, double speed_mps, const FollowParams& params);

struct Steering {
  double speed_mps = 0.0;  ///< negative: backwards
  double curvature_1pm = 0.0;
  double off_m = 0.0;   ///< lateral error from the path
  bool at_end = false;  ///< of the path
};

/// Pure pursuit (Coulter 1992).
/// @param at  index of the last point that the vehicle has passed; never decreases
[[nodiscard]] Steering follow(const Path& path, const Pose2d& vehicle, double speed_mps,
                              const FollowParams& params, const Shape& shape, std::size_t* at);

/// Distance that the vehicle can drive before it would come nearer to a known obstacle than
/// `required_m`; at most `max_m`. The motion is predicted, as the steering rate is limited and the
/// vehicle may be off its path.
/// @param at         see follow()
/// @param vehicle    with the present curvature of its wheels
/// @param direction  1 ahead, -1 backwards
[[nodiscard]] double free_way(const Body& body, const ObstacleDistance& obstacles, const Path& path,
                              std::size_t at, const Pose2d& vehicle, double speed_mps,
                              int direction, const FollowParams& params, const Shape& shape,
                              double required_m, double max_m);

}  // namespace rcs::bg
