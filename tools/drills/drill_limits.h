#pragma once
// The metrics of drills on which limits can be set.

#include <string_view>

#include "rcs/node/params/params.h"

namespace rcs::drills {

struct LimitKind {
  std::string_view key;    ///< in [limits]
  std::string_view title;  ///< in tables
  std::string_view unit;
  bool at_least = false;  ///< else: at most
  bool needs_integrity = false;
  bool overview = true;  ///< has a column in the table of all drills
  Range range;           ///< of the limit
  std::string_view meaning;
};

/// With fewer seeds a median or a ratio is not significant: the verdict is inconclusive.
constexpr int kSeedsForMedian = 5;
constexpr int kSeedsForRatio = 20;
/// Lower bound of the RMS horizontal error in the ratio [m].
constexpr double kRatioFloor_m = 0.2;

// clang-format off
inline constexpr LimitKind kLimits[] = {
    // key, title, unit, at least, needs integrity, overview, range, meaning
    {"drift_pct_median", "drift, median", "%", false, false, false, {0, 100},
     "Largest median, over the seeds, of the horizontal error at the end of an outage in percent of the distance driven in it."},
    {"drift_pct_p95", "drift, 95 %", "%", false, false, true, {0, 100},
     "Largest 95th percentile, over the seeds (of few seeds nearly the largest value), of the horizontal error at the end of an outage in percent of the distance driven in it."},
    {"false_acceptances", "false fixes accepted", "", false, false, true, {0, 1e6},
     "Largest number, of all seeds together, of accepted fixes with an error of more than six total standard deviations."},
    {"smooth_step_m", "smooth step", "m", false, false, true, {0, 1000},
     "Largest step of the local pose beyond the motion predicted from the cycle before."},
    {"alarm_within_s", "time to alert", "s", false, true, true, {0, 1e5},
     "Longest time from the beginning of a fault of a source to its alert."},
    {"accept_within_s", "GPS back after", "s", false, false, true, {0, 1e5},
     "Longest time from the first clean fix to the first accepted one."},
    {"within_protection", "within protection", "", true, true, true, {0, 1},
     "Smallest share of the time, mean of the seeds, in which the error is within the protection level."},
    {"missed_alerts", "missed alerts", "", false, true, true, {0, 1e6},
     "Largest number of times, of all seeds together, that the error exceeds the protection level for 2 s without an alert."},
    {"false_alerts_per_h", "false alerts", "1/h", false, true, true, {0, 1e6},
     "Largest number of alerts per hour, mean of the seeds, while no source is faulty."},
    {"ratio", "ratio to baselines", "", false, false, true, {0, 1000},
     "Largest ratio of the RMS error to that of the best baseline filter, which lacks some source."},
    {"horizontal_m", "horizontal error", "m", false, false, false, {0, 1e6},
     "Largest horizontal error."},
    {"overruns", "overruns", "", false, false, false, {0, 1e9},
     "Largest number of cycles, of all seeds together, that nominally end after their deadline or do not run."},
};
// clang-format on

}  // namespace rcs::drills
