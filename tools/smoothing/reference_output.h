#pragma once
// Output of the reference trajectory: files and report.

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/smoothing/reference_smoother.h"

namespace rcs::smoothing {

/// One line of the output files, for one scan.
struct ReferencePose {
  Stamp stamp;      ///< reference instant of the scan
  Pose T;           ///< pose of the vehicle
  Pose T_seen;      ///< pose that places the points with the configured mount and clock
  Vec6 absolute;    ///< one sigma, (rho, phi): vehicle axes
  Vec6 from_first;  ///< one sigma of the motion since the first pose
};

/// Errors against SIM_TRUTH, after the best rigid alignment.
struct ReferenceErrors {
  std::size_t poses = 0;
  double position_m = 0.0;  ///< RMS
  double horizontal_m = 0.0, vertical_m = 0.0;
  double position_max_m = 0.0;
  double rotation_deg = 0.0;         ///< RMS
  Vec3 mounting_deg = Vec3::Zero();  ///< mean, about the vehicle axes: common misalignment of
                                     ///< INS and LADAR, which is unobservable
  double rotation_less_mounting_deg = 0.0;  ///< RMS
  Vec3 offset_m = Vec3::Zero();  ///< mean of true minus estimated positions, no alignment
  double offset_squared = 0.0;   ///< normalized by its covariance; 95 %: below 7.81
};

struct ReferenceReport {
  std::string frame;  ///< "world" or "local"
  std::size_t scans = 0, poses = 0;
  double travelled_m = 0.0;
  std::optional<ReferenceErrors> errors;         ///< of the smoothed poses
  std::optional<ReferenceErrors> errors_before;  ///< of the online poses of WM, in the same frame
};

[[nodiscard]] std::vector<ReferencePose> reference_poses(const ReferenceRecording& recording,
                                                         const ReferenceResult& result);
[[nodiscard]] ReferenceReport report_reference(const ReferenceRecording& recording,
                                               const ReferenceResult& result,
                                               const std::vector<ReferencePose>& poses);

[[nodiscard]] nlohmann::ordered_json to_json(const ReferenceReport& report,
                                             const ReferenceResult& result);
[[nodiscard]] std::string to_text(const ReferenceReport& report, const ReferenceResult& result);

/// Header "t_s,sigma_x_m,..." and one line per pose.
[[nodiscard]] std::string format_sigmas(const std::vector<ReferencePose>& poses);

}  // namespace rcs::smoothing
