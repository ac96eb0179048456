#pragma once
// How far the position may be off, and for how long it will do.

#include <limits>

#include "modules/wm/fault_detection.h"

namespace rcs::wm {

/// Bits; the values are integrity_t's.
enum Alert : int {
  kAlertHorizontal = 1,
  kAlertVertical = 2,
  kAlertGps = 4,
  kAlertLadar = 8,
  kAlertInput = 16
};

/// The values are integrity_t's.
enum class Validity : int { kNone = 0, kLocal = 1, kWorld = 2 };

struct Integrity {
  Validity validity = Validity::kNone;
  /// The error is smaller but for one moment in a thousand: what the covariance says, and beyond it
  /// how far fixes could have led the belief unseen, and what refused fixes would have it be.
  /// Infinite unless `validity` is kWorld.
  double protection_horizontal_m = std::numeric_limits<double>::infinity();
  double protection_vertical_m = std::numeric_limits<double>::infinity();
  int alerts = 0;
  double sigma_in_60s_m = 0.0;  ///< horizontal, if no fix comes
  double alert_in_s = -1.0;     ///< until a limit is passed, if no fix comes; -1: not in 10 minutes
};

/// @param state  the newest; @param trust  what is believed of its sources
/// @param silent_for  by how much the silence of all inputs exceeds its limit; not above zero: some
///   input is received
[[nodiscard]] Integrity integrity(const FilterState& state, const Trust& trust, Duration silent_for,
                                  const WmParams& params);

}  // namespace rcs::wm
