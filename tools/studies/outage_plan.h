#pragma once
// What must be run to tell how far off the vehicle would be if GPS died: a question, and the drills
// without marks that answer it. Pure functions.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/drills/drill_spec.h"

namespace rcs::studies {

/// What is asked. Times count from the first sensor message.
struct OutageQuestion {
  std::vector<double> lengths_s = {10.0, 20.0, 30.0};
  int places = 10;       ///< of each length, as far from one another as they can be
  double from_s = 20.0;  ///< no outage begins before
  /// One outage instead; the drive goes on to the log's end.
  std::optional<drills::DrillWindow> cut;
  /// Every outage is tried once more without these, from the log's begin on.
  std::vector<std::vector<drills::DrillSource>> without;

  /// @param variant  0: all sources; k: without[k - 1]
  [[nodiscard]] bool uses(std::size_t variant, drills::DrillSource source) const;
};

/// "odometry+ladar"; gps has no business here.
[[nodiscard]] Result<std::vector<drills::DrillSource>> parse_without(const std::string& text);

/// One run that answers the question.
struct OutagePlan {
  enum class Kind {
    kUncut,   ///< GPS all along
    kOutage,  ///< GPS withheld in `window`
    kNoGps    ///< never any GPS: what the LADAR finds alone
  };
  Kind kind = Kind::kOutage;
  std::size_t variant = 0;  ///< 0: all sources; k: OutageQuestion::without[k - 1]
  drills::DrillWindow window;
  drills::Drill drill;  ///< that does it
};

/// @param drive_s  of the log, by its sensor messages
/// @param ladar  the log has a LADAR
/// @return an error when an outage does not fit into the drive
[[nodiscard]] Result<std::vector<OutagePlan>> plan_outages(const OutageQuestion& question,
                                                           double drive_s, bool ladar);

}  // namespace rcs::studies
