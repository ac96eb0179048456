#pragma once
// Protection levels, alerts, and the predicted growth of the position error.

#include <limits>

#include "modules/wm/fault_detection/fault_detection.h"

namespace rcs::wm {

/// Bits; the values are those of integrity_t.
enum Alert : int {
  kAlertHorizontal = 1,
  kAlertVertical = 2,
  kAlertGps = 4,
  kAlertLadar = 8,
  kAlertInput = 16,
  kAlertIns = 32,
  kAlertOdometry = 64
};

/// The values are those of integrity_t.
enum class Validity : int { kNone = 0, kLocal = 1, kWorld = 2 };

struct Integrity {
  Validity validity = Validity::kNone;
  /// The error exceeds the level at 1 moment in 1000 at most, if the covariance is consistent and
  /// no fault is undetected. The horizontal level also contains the minimum detectable error of
  /// GPS, up to 0.8 of the alert limit, and the distance of an alternative hypothesis; an
  /// undetected GPS fault can exceed it. Infinite unless `validity` is kWorld.
  double protection_horizontal_m = std::numeric_limits<double>::infinity();
  double protection_vertical_m = std::numeric_limits<double>::infinity();
  int alerts = 0;
  double sigma_in_60s_m = 0.0;  ///< horizontal, if no fix is received
  double alert_in_s =
      -1.0;  ///< until a limit is exceeded, if no fix is received; -1: not in 10 minutes
};

/// @param state  the newest; @param fault_detection  status and tests of its sources
/// @param silent_for  excess of the silence of all inputs over its limit; zero or less: some input
///   is received
[[nodiscard]] Integrity integrity(const FilterState& state, const FaultDetection& fault_detection,
                                  Duration silent_for, const WmParams& params);

}  // namespace rcs::wm
