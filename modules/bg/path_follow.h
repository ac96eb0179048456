#pragma once
// From a path to what the vehicle is told now: how fast each point of it may be driven, and how to
// steer along it.

#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/bg/path_search.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

struct FollowParams {
  double braking_mps2 = 1.5;  ///< that the planned speeds count on
  double lookahead_s = 0.8;   ///< of driving, to the point that is steered at
  double lookahead_min_m = 2.0;
  double latency_s = 0.25;  ///< until the wheels obey
  double keep_cost = 1.15;  ///< a new way must be cheaper by this to replace the one under way
  double keep_m = 10.0;     ///< of way that must be left for that
  double astray_m = 1.0;    ///< off the path by more: a new one is needed
};

/// Fills in limit_mps and speed_mps: what ground, turns and obstacles allow (vj), and what can be
/// braked from, to a stop at the end of the path and wherever it changes direction.
/// @param terrain  in the path's frame
/// @param most_mps  whatever the ground allows
/// @param share  of the speed, (0, 1]: how sure the pose is
void plan_speeds(const vj::Terrain& terrain, const vj::Weights& weights,
                 const vj::SpeedParams& speeds, const FollowParams& params, const Shape& shape,
                 double most_mps, double share, Path* path);

/// How far the vehicle comes, steered as it is about to be, before it would touch what is known to
/// be in its way; at most `most_m`. Whatever the path says: the wheels turn only so fast, and a
/// vehicle is not always where its path is.
/// @param vehicle    with the curvature that its wheels have now
/// @param curvature_1pm  that they are told
/// @param direction  1 ahead, -1 backwards
[[nodiscard]] double free_way(const PathSearch& body, const ObstacleDistance& obstacles,
                              const Place& vehicle, double speed_mps, double curvature_1pm,
                              int direction, const Shape& shape, double most_m);

/// The fastest that still stops within `free_m`.
[[nodiscard]] double speed_within(double free_m, double speed_mps, const FollowParams& params);

struct Steering {
  double speed_mps = 0.0;  ///< negative: backwards
  double curvature_1pm = 0.0;
  double off_m = 0.0;   ///< from the path, sideways
  bool at_end = false;  ///< of the path
};

/// Pure pursuit (Coulter 1992).
/// @param at  index of the point that the vehicle has passed last; moves on, never back
[[nodiscard]] Steering follow(const Path& path, const Place& vehicle, double speed_mps,
                              const FollowParams& params, const Shape& shape, std::size_t* at);

}  // namespace rcs::bg
