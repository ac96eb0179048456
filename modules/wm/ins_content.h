#pragma once
// Detects increments that no working INS measures: the same values again and again, or no specific
// force. Such a sample is treated as if it had not been received.

#include "modules/wm/eskf.h"

namespace rcs::wm {

class InsContent {
 public:
  /// @return false: the sample is not a measurement
  [[nodiscard]] bool add(const ImuSample& imu);

 private:
  // A real sensor has noise. A sensor without noise (a simulation) repeats its values at rest and
  // on a straight line, so repetition counts only after values that have varied for some time.
  static constexpr int kVaried = 100;
  static constexpr int kStuck = 8;
  static constexpr int kWeightless = 8;
  static constexpr double kLeastForce_mps2 = 1.0;  ///< a vehicle in the air falls only for a moment

  ImuSample last_;
  int varied_ = 0;      ///< samples in a row that differed from the one before, until kVaried
  int repeated_ = 0;    ///< in a row
  int weightless_ = 0;  ///< in a row
};

}  // namespace rcs::wm
