#pragma once
// The figures of one run of a drill about trust: what was believed that should not have been, what
// was refused that should have been believed, and whether WM said so in time.

#include <optional>
#include <vector>

#include "tools/drills/drill_metrics.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// A fix more than 6 total sigma (reported and the belief's) off that WM took.
struct FalseAcceptance {
  double t_s = 0.0;
  double error_m = 0.0;
  double sigmas = 0.0;
};
[[nodiscard]] std::vector<FalseAcceptance> false_acceptances(const DrillRecord& record,
                                                             const DrillErrors& errors);

/// After GPS was disturbed: the first clean fix, and when WM took one again.
struct GpsReturn {
  double clean_s = 0.0;                    ///< arrival of the first clean fix
  std::optional<double> accepted_after_s;  ///< none: never again
};
/// One for every window of a GPS stimulus behind which a clean fix comes. A fix is clean when it is
/// less than 4 of its reported sigmas off.
[[nodiscard]] std::vector<GpsReturn> gps_returns(const Drill& drill, const DrillRecord& record,
                                                 const DrillErrors& errors);

/// Only where WM_INTEGRITY was published.
struct IntegrityFigures {
  std::size_t samples = 0;
  double within_horizontal = 0.0;  ///< share of the time with the error within the protection level
  double within_vertical = 0.0;
  int missed_alerts = 0;
  double false_alerts_per_h = 0.0;
  /// Of the false sources that last 2 s or longer, the slowest; none: never, or there is no such.
  std::optional<double> time_to_alert_s;
  bool alert_expected = false;
};
[[nodiscard]] std::optional<IntegrityFigures> integrity_figures(const Drill& drill,
                                                                const DrillRecord& record,
                                                                const DrillErrors& errors);

}  // namespace rcs::drills
