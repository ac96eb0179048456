#pragma once
// Smoothing of the paths of the search, whose curvature changes by steps: the vehicle would have to
// slow down at each of them.

#include <optional>

#include "modules/bg/body.h"
#include "modules/bg/cost_field.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

/// Moves the points of the legs ahead so that the sum of the squared changes of the curvature and
/// of the squared displacements is least; on open ground with more weight on the former. The
/// ends of each leg stay, with their headings. Where the result would come nearer to an obstacle
/// than `weights.near_m` (with the least weight: `margin_m`), and nearer than the path was, or turn
/// sharper than the vehicle can, the points are held; a leg for which that does not suffice stays
/// as it is. Sets place, s_m and clearance_m. Allocates nothing.
/// @param through  a goal through which the path leads, and continues to lead
void smooth(const Body& body, const ObstacleDistance& obstacles, const Shape& shape,
            const vj::Weights& weights, const std::optional<Goal>& through, Path* path);

}  // namespace rcs::bg
