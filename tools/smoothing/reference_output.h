#pragma once
// What the truth of a drive looks like in files and in figures.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/smoothing/reference_smoother.h"

namespace rcs::smoothing {

/// One line of what is written, for one scan.
struct TruthPose {
  Stamp stamp;      ///< the scan's reference instant
  Pose T;           ///< the vehicle then
  Pose T_seen;      ///< where the scan's points lie, as the configuration has mount and clock
  Vec6 absolute;    ///< one sigma, (rho, phi): vehicle axes
  Vec6 from_first;  ///< likewise, of the motion since the first pose
};

/// How far it is from what a simulator knows, after the best rigid alignment.
struct TruthErrors {
  std::size_t poses = 0;
  double position_m = 0.0;  ///< RMS
  double horizontal_m = 0.0, vertical_m = 0.0;
  double position_max_m = 0.0;
  double rotation_deg = 0.0;         ///< RMS
  Vec3 mounting_deg = Vec3::Zero();  ///< the mean of it, about the vehicle's axes: how INS and
                                     ///< LADAR are turned in the vehicle, which neither can know
  double rotation_less_mounting_deg = 0.0;  ///< RMS
  Vec3 offset_m = Vec3::Zero();             ///< mean of true less estimated positions, no alignment
  double offset_squared = 0.0;              ///< by its own covariance; 95 %: below 7.81
};

struct TruthReport {
  std::string frame;  ///< "world" or "local"
  std::size_t scans = 0, poses = 0;
  double way_m = 0.0;
  std::optional<TruthErrors> errors;         ///< of the smoothed poses
  std::optional<TruthErrors> errors_before;  ///< of WM's as it went, in the same frame
};

[[nodiscard]] std::vector<TruthPose> truth_poses(const TruthRecording& recording,
                                                 const TruthResult& result);
[[nodiscard]] TruthReport report_truth(const TruthRecording& recording, const TruthResult& result,
                                       const std::vector<TruthPose>& poses);

[[nodiscard]] nlohmann::ordered_json to_json(const TruthReport& report, const TruthResult& result);
[[nodiscard]] std::string to_text(const TruthReport& report, const TruthResult& result);

/// "# t sigma_x_m ... " and a line a pose.
[[nodiscard]] std::string format_sigmas(const std::vector<TruthPose>& poses);

}  // namespace rcs::smoothing
