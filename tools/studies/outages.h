#pragma once
// Position error after GPS outages, from the records of the runs planned in outage_plan.h. Pure
// functions.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/studies/dead_reckoning.h"
#include "tools/studies/outage_plan.h"

namespace rcs::studies {

/// Estimators of the pose at the end of an outage. All except WM continue from the belief of WM at
/// the begin of the outage, with the sensor errors estimated until then.
enum class PoseEstimator {
  kWm,
  kWmWithGps,
  kGyroAndWheels,
  kGyroAndLastSpeed,
  kWheels,
  kInertial,
  kLadar
};
constexpr std::size_t kPoseEstimators = 7;
[[nodiscard]] std::string_view estimator_name(PoseEstimator estimator);

/// Error against the reference.
struct OutageError {
  double horizontal_m = 0.0;
  double vertical_m = 0.0;   ///< magnitude
  double heading_rad = 0.0;  ///< estimate - reference
};

struct OutageFinding {
  std::size_t variant = 0;  ///< as OutagePlan::variant
  drills::DrillWindow window;
  std::string failed;  ///< reason if there are no errors, else empty
  double driven_m = 0.0;
  std::optional<OutageError> at_begin;                               ///< of WM
  std::array<std::optional<OutageError>, kPoseEstimators> at_end{};  ///< nullopt: no estimate
  double sigma_m = 0.0;  ///< horizontal, of WM at the end
  /// Horizontal, from the belief of WM without GPS to the first fix after the outage.
  std::optional<double> to_fix_m;
  std::optional<double> fix_sigma_m;  ///< of the fix, the larger of east and north
  /// From the first correct fix to the first one accepted by WM; nullopt: not within the run.
  std::optional<double> back_after_s;
  bool may_be_back = false;  ///< correct fixes lasted long enough to decide
  /// At the last belief of the log; for a cut.
  std::optional<OutageError> at_log_end;
};

/// Horizontal distance of the end of the drive from its begin [m]: for a closed course this is the
/// error. WM: from the first fix to its last belief. Other estimators: over the whole drive,
/// without WM.
struct ClosureFinding {
  std::size_t variant = 0;
  std::array<std::optional<double>, kPoseEstimators> m{};
  std::optional<double> fixes_m;  ///< first to last fix
};

/// Status of GPS without any cut.
struct WithGpsFinding {
  double accepted_share = 0.0;  ///< share of the time after `from_s` in which GPS was accepted
  std::vector<drills::DrillEvent> warnings;  ///< warnings and worse
};

struct OutageReport {
  std::string reference;  ///< reference of the errors, as text
  std::vector<std::string> variants;
  std::vector<OutageFinding> findings;
  std::vector<ClosureFinding> closures;  ///< of a cut
  WithGpsFinding with_gps;
};

/// @param plans, results  in the same order
[[nodiscard]] OutageReport judge_outages(const OutageQuestion& question,
                                         const std::vector<OutagePlan>& plans,
                                         const std::vector<drills::DrillResult>& results,
                                         const RecordedMotion& motion);

}  // namespace rcs::studies
