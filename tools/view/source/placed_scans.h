#pragma once
// Scans before a moment, each at its pose: the surroundings that a single scan does not show.

#include <cstdint>
#include <string>

#include "rcs/base/stamp.h"
#include "rcs/ros2/frames.h"
#include "tools/view/source/log_index.h"

namespace rcs::view {

/// The parts of SP_POINTS within (time - span, time] in frame world. For each part: float64 stamp
/// [s] as in /sp/points, uint32 n, uint32 0, and n times float32 x, y, z [m]; little-endian.
/// Parts without a pose of WM are omitted, and of large ones only every k-th point is included.
[[nodiscard]] std::string placed_scans(LogIndex* index, const ros2::ClockOffsets& clocks,
                                       Duration time, Duration span);

}  // namespace rcs::view
