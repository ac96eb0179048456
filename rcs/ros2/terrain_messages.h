#pragma once
// WM's terrain as messages of ROS 2, in frame `odom`. Each function returns nullopt for a patch
// whose sizes contradict each other.

#include <optional>

#include "lcmtypes/rcs/map_patch_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/nav_types.h"

namespace rcs::ros2 {

/// 100 for a cell that is not traversable, 0 for other observed cells, -1 for unknown ones.
[[nodiscard]] std::optional<msg::OccupancyGrid> to_occupancy(const map_patch_t& m,
                                                             const ClockOffsets& clocks);

/// Layers elevation [m], step [m], slope [rad], roughness [m] and obstacle (0, 1); unknown cells
/// are NaN. Cell (row 0, column 0) is at the largest x and y; rows proceed against x, columns
/// against y, and a layer is stored by columns (github.com/ANYbotics/grid_map, conventions).
[[nodiscard]] std::optional<msg::GridMap> to_grid_map(const map_patch_t& m,
                                                      const ClockOffsets& clocks);

}  // namespace rcs::ros2
