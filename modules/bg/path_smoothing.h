#pragma once
// Smoothing of the paths of the search, whose curvature changes by steps: the vehicle would have to
// slow down at each of them.

#include "modules/bg/body.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"

namespace rcs::bg {

/// Moves the points of the legs ahead so that the sum of the squared changes of the curvature and
/// of the squared displacements is least. The ends of each leg stay, with their headings. Where the
/// result would come nearer to an obstacle than `margin_m`, and nearer than the path was, or turn
/// sharper than the vehicle can, the points are held; a leg for which that does not suffice stays
/// as it is. Sets place, s_m and clearance_m. Allocates nothing.
void smooth(const Body& body, const ObstacleDistance& obstacles, const Shape& shape,
            double margin_m, Path* path);

}  // namespace rcs::bg
