#pragma once
// The runs that measure the position error after GPS outages: a plan of drills without limits. Pure
// functions.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/drills/drill_spec.h"

namespace rcs::studies {

/// Parameters of the study. Times are relative to the first sensor message.
struct OutageQuestion {
  std::vector<double> lengths_s = {10.0, 20.0, 30.0};
  int places = 10;       ///< outages of each length, evenly distributed
  double from_s = 20.0;  ///< earliest begin of an outage
  /// A single outage instead; the run continues to the end of the log.
  std::optional<drills::DrillWindow> cut;
  /// Every outage is repeated without these sources, excluded from the begin of the log on.
  std::vector<std::vector<drills::DrillSource>> without;

  /// @param variant  0: all sources; k: without[k - 1]
  [[nodiscard]] bool uses(std::size_t variant, drills::DrillSource source) const;
};

/// Parses "odometry+ladar"; gps is an error.
[[nodiscard]] Result<std::vector<drills::DrillSource>> parse_without(const std::string& text);

/// One run of the study.
struct OutagePlan {
  enum class Kind {
    kWmWithGps,  ///< GPS in the whole run
    kOutage,     ///< GPS denied in `window`
    kNoGps       ///< no GPS in the whole run: LADAR alone
  };
  Kind kind = Kind::kOutage;
  std::size_t variant = 0;  ///< 0: all sources; k: OutageQuestion::without[k - 1]
  drills::DrillWindow window;
  drills::Drill drill;  ///< of this run
};

/// @param drive_s  duration of the log, by its sensor messages
/// @param ladar  the log has a LADAR
/// @return an error if an outage does not fit into the drive
[[nodiscard]] Result<std::vector<OutagePlan>> plan_outages(const OutageQuestion& question,
                                                           double drive_s, bool ladar);

}  // namespace rcs::studies
