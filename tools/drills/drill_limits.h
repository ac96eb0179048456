#pragma once
// The names of the figures that a drill may be held against, and how.

#include <string_view>

#include "rcs/node/params/params.h"

namespace rcs::drills {

struct MarkKind {
  std::string_view key;    ///< in [marks]
  std::string_view title;  ///< in tables
  std::string_view unit;
  bool at_least = false;  ///< else: at most
  bool needs_integrity = false;
  bool overview = true;  ///< has a column in the table of all drills
  Range range;           ///< of the limit
  std::string_view about;
};

/// Fewer seeds than this say little about a median or a ratio: the mark stays open.
constexpr int kSeedsForMedian = 5;
constexpr int kSeedsForRatio = 20;
/// No baseline counts as better than this: RMS of the horizontal error [m].
constexpr double kRatioFloor_m = 0.2;

// clang-format off
inline constexpr MarkKind kMarks[] = {
    // key, title, unit, at least, needs integrity, overview, range
    {"drift_pct_median", "drift, median", "%", false, false, false, {0, 100},
     "horizontal error at the end of an outage in percent of the distance driven in it"},
    {"drift_pct_p95", "drift, 95 %", "%", false, false, true, {0, 100},
     "the same, of 95 % of the seeds"},
    {"false_acceptances", "false fixes taken", "", false, false, true, {0, 1e6},
     "fixes more than 6 total sigma off that WM took"},
    {"smooth_step_m", "smooth step", "m", false, false, true, {0, 1000},
     "largest step of the local pose beyond the motion predicted from the cycle before"},
    {"alarm_within_s", "time to alert", "s", false, true, true, {0, 1e5},
     "from the begin of a false source to its alert"},
    {"accept_within_s", "GPS back after", "s", false, false, true, {0, 1e5},
     "from the first clean fix to the first one that WM takes"},
    {"within_protection", "within protection", "", true, true, true, {0, 1},
     "share of the time with the error within the protection level"},
    {"missed_alerts", "missed alerts", "", false, true, true, {0, 1e6},
     "error above the protection level for 2 s without an alert"},
    {"false_alerts_per_h", "false alerts", "1/h", false, true, true, {0, 1e6},
     "alerts while nothing is wrong"},
    {"ratio", "ratio to baselines", "", false, false, true, {0, 1000},
     "RMS error over that of the best filter that goes without some source"},
    {"horizontal_m", "horizontal error", "m", false, false, false, {0, 1e6},
     "largest"},
    {"overruns", "overruns", "", false, false, false, {0, 1e9},
     "cycles after their deadline, or not run at all, nominally"},
};
// clang-format on

}  // namespace rcs::drills
