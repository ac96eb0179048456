#pragma once
// Detects increments that no working INS measures: the same values again and again, or no specific
// force. WM and SP treat such a sample as if it had not been received.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lcmtypes/rcs/ins_t.hpp"

namespace rcs {

class InsContent {
 public:
  /// @param m  in the order of reception
  /// @return false: the sample is not a measurement
  [[nodiscard]] bool add(const ins_t& m) {
    bool same = m.utime != last_.utime;
    bool zero = true;
    double force = 0.0;
    for (int i = 0; i < 3; ++i) {
      same = same && m.delta_angle_rad[i] == last_.delta_angle_rad[i] &&
             m.delta_v_mps[i] == last_.delta_v_mps[i];
      zero = zero && m.delta_v_mps[i] == 0.0;
      force = std::hypot(force, m.delta_v_mps[i]);
    }
    last_ = m;
    repeated_ = same ? repeated_ + 1 : 0;
    if (!same) varied_ = std::min(varied_ + 1, kVaried);
    if (same && varied_ < kVaried) varied_ = 0;
    const bool weightless = force < kLeastForce_mps2 * 1e-6 * m.interval_us;
    weightless_ = weightless ? weightless_ + 1 : 0;
    const bool stuck = repeated_ >= kStuck && varied_ >= kVaried;
    return !stuck && !zero && weightless_ < kWeightless;
  }

 private:
  // A real sensor has noise. A sensor without noise (a simulation) repeats its values at rest and
  // on a straight line, so repetition counts only after values that have varied for some time.
  static constexpr int kVaried = 100;
  static constexpr int kStuck = 8;
  static constexpr int kWeightless = 8;
  static constexpr double kLeastForce_mps2 = 1.0;  ///< a vehicle in the air falls only for a moment

  ins_t last_{};
  int varied_ = 0;      ///< samples in a row that differed from the one before, until kVaried
  int repeated_ = 0;    ///< in a row
  int weightless_ = 0;  ///< in a row
};

}  // namespace rcs
