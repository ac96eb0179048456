#pragma once
// Trajectories and two common text formats.
//   KITTI: one line per pose, the upper 3x4 of T_frame_vehicle row by row; no stamps.
//   TUM:   "t x y z qx qy qz qw", t in seconds; lines that begin with # are comments.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::tools {

struct StampedPose {
  Stamp stamp;  ///< sensor time
  Pose T;       ///< T_frame_vehicle; the name of the trajectory contains the frame
};

/// Stamps ascend strictly.
using Trajectory = std::vector<StampedPose>;

/// The pose at `stamp`: the sample itself, or on the screw motion between its neighbours.
/// nullopt outside the trajectory, or in a gap longer than `max_gap`.
[[nodiscard]] std::optional<Pose> pose_at(const Trajectory& trajectory, Stamp stamp,
                                          Duration max_gap);

/// The finite numbers of a line, separated by blanks or commas; nullopt for other content.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view line);

/// @param name  for messages: the file
/// @return an error with the line: not 12 numbers, or not a rotation (error of more than 1e-3)
[[nodiscard]] Result<std::vector<Pose>> parse_kitti(std::string_view text, std::string_view name);
[[nodiscard]] Result<Trajectory> parse_tum(std::string_view text, std::string_view name);

/// Ten significant digits: 0.1 um at 1 km.
[[nodiscard]] std::string format_kitti(const Trajectory& trajectory);
[[nodiscard]] std::string format_tum(const Trajectory& trajectory);

/// Distance driven up to each pose [m]; same size as `poses`, the first is 0.
[[nodiscard]] std::vector<double> distances(const std::vector<Pose>& poses);

}  // namespace rcs::tools
