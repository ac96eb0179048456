#pragma once
// Detects increments that no working INS measures: the same values again and again, or a specific
// force that does not point upwards. WM and SP treat such a sample as if it had not been received.

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
    for (int i = 0; i < 3; ++i) {
      same = same && m.delta_angle_rad[i] == last_.delta_angle_rad[i] &&
             m.delta_v_mps[i] == last_.delta_v_mps[i];
      zero = zero && m.delta_v_mps[i] == 0.0;
    }
    repeated_ = same ? repeated_ + 1 : 0;
    if (!same) varied_ = std::min(varied_ + 1, kVaried);
    if (same && varied_ < kVaried) varied_ = 0;
    const bool stuck = repeated_ >= kStuck && varied_ >= kVaried;

    const double interval_s = 1e-6 * std::max(m.interval_us, 1);
    const double share = last_.utime == 0 ? 1.0 : std::min(1.0, interval_s / kMean_s);
    up_mps2_ += share * (m.delta_v_mps[2] / interval_s - up_mps2_);
    last_ = m;
    // Not finite: plausible() rejects it.
    if (!std::isfinite(up_mps2_)) up_mps2_ = 0.0;
    return !stuck && !zero && up_mps2_ >= kLeastUp_mps2;
  }

 private:
  // A real sensor has noise. A sensor without noise (a simulation) repeats its values at rest and
  // on a straight line, so repetition counts only after values that have varied for some time.
  static constexpr int kVaried = 100;
  static constexpr int kStuck = 8;
  // Less than on a slope of 60 degrees. Exchanged axes or an inverted one move the filter by five
  // metres in the first second, before any other test can know; a fall of a tenth of a second is
  // bridged like a lost sample.
  static constexpr double kLeastUp_mps2 = 3.5;
  static constexpr double kMean_s = 0.1;

  ins_t last_{};
  int varied_ = 0;        ///< samples in a row that differed from the one before, until kVaried
  int repeated_ = 0;      ///< in a row
  double up_mps2_ = 0.0;  ///< low-passed specific force along the vehicle's z axis
};

}  // namespace rcs
