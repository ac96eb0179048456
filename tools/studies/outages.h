#pragma once
// How far off would the vehicle be if GPS died? A log is driven again with GPS cut at many places
// (outage_plan.h), and this is what the runs' records say. Pure functions.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/studies/dead_reckoning.h"
#include "tools/studies/outage_plan.h"

namespace rcs::studies {

/// Who says where the vehicle is when the outage ends. All but WM carry on from WM's belief at its
/// beginning, by what was learnt of the sensors until then.
enum class Teller { kWm, kUncut, kGyroAndWheels, kGyroAndLastSpeed, kWheels, kInertial, kLadar };
constexpr std::size_t kTellers = 7;
[[nodiscard]] std::string_view teller_name(Teller teller);

/// Against the reference.
struct OutageError {
  double horizontal_m = 0.0;
  double vertical_m = 0.0;   ///< magnitude
  double heading_rad = 0.0;  ///< estimate - reference
};

struct OutageFinding {
  std::size_t variant = 0;  ///< as OutagePlan::variant
  drills::DrillWindow window;
  std::string failed;  ///< why there are no errors; empty: there are
  double driven_m = 0.0;
  std::optional<OutageError> at_begin;                        ///< WM's
  std::array<std::optional<OutageError>, kTellers> at_end{};  ///< none: it cannot say
  double sigma_m = 0.0;                                       ///< horizontal, that WM claims at end
  /// Horizontal, from WM's belief without GPS to the first fix behind the outage.
  std::optional<double> to_fix_m;
  std::optional<double> fix_sigma_m;  ///< that the fix claims, the larger of east and north
  /// From the first fix that is right again to the first one that WM takes; none: not within the
  /// run.
  std::optional<double> back_after_s;
  bool may_be_back = false;  ///< right fixes came for long enough to tell
  /// At the log's last belief; for a cut.
  std::optional<OutageError> at_log_end;
};

/// How far the drive's end is from its begin, horizontally [m]: of a drive that ends where it
/// began, the error. WM: from the first fix to its last belief. Those that carry on: all the way,
/// without WM.
struct ClosureFinding {
  std::size_t variant = 0;
  std::array<std::optional<double>, kTellers> m{};
  std::optional<double> fixes_m;  ///< first to last fix
};

/// How GPS fared without any cut.
struct UncutFinding {
  double trusted_share = 0.0;                  ///< of the drive since `from_s`
  std::vector<drills::DrillEvent> complaints;  ///< warnings and worse
};

struct OutageReport {
  std::string reference;  ///< what the errors are against, in words
  std::vector<std::string> variants;
  std::vector<OutageFinding> findings;
  std::vector<ClosureFinding> closures;  ///< of a cut
  UncutFinding uncut;
};

/// @param plans, results  of the same order: what was to be run and what came of it
[[nodiscard]] OutageReport judge_outages(const OutageQuestion& question,
                                         const std::vector<OutagePlan>& plans,
                                         const std::vector<drills::DrillResult>& results,
                                         const RecordedMotion& motion);

}  // namespace rcs::studies
