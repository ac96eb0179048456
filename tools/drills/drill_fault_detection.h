#pragma once
// Metrics of fault detection in one run of a drill: false measurements accepted, good measurements
// rejected, and the time to alert.

#include <optional>
#include <vector>

#include "tools/drills/drill_metrics.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// An accepted fix with an error of more than 6 total sigma (of the fix and the belief).
struct FalseAcceptance {
  double t_s = 0.0;
  double error_m = 0.0;
  double sigmas = 0.0;
};
[[nodiscard]] std::vector<FalseAcceptance> false_acceptances(const DrillRecord& record,
                                                             const DrillErrors& errors);

/// After a disturbance of GPS: the first clean fix, and the time until WM accepted one.
struct GpsReturn {
  double clean_s = 0.0;                    ///< arrival of the first clean fix
  std::optional<double> accepted_after_s;  ///< nullopt: never
};
/// One for every window of a GPS stimulus that is followed by a clean fix. A fix is clean if its
/// error is less than 4 of its reported sigmas.
[[nodiscard]] std::vector<GpsReturn> gps_returns(const Drill& drill, const DrillRecord& record,
                                                 const DrillErrors& errors);

/// Only if WM_INTEGRITY was published.
struct IntegrityMetrics {
  std::size_t samples = 0;
  double within_horizontal = 0.0;  ///< share of the time with the error within the protection level
  double within_vertical = 0.0;
  int missed_alerts = 0;
  double false_alerts_per_h = 0.0;
  /// Longest time of the false sources that last 2 s or longer; nullopt: no alert or no such
  /// source.
  std::optional<double> time_to_alert_s;
  bool alert_expected = false;
};
[[nodiscard]] std::optional<IntegrityMetrics> integrity_metrics(const Drill& drill,
                                                                const DrillRecord& record,
                                                                const DrillErrors& errors);

}  // namespace rcs::drills
