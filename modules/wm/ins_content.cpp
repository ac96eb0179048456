#include "modules/wm/ins_content.h"

#include <algorithm>

namespace rcs::wm {

bool InsContent::add(const ImuSample& imu) {
  const bool same = imu.delta_angle == last_.delta_angle && imu.delta_v == last_.delta_v &&
                    imu.stamp != last_.stamp;
  last_ = imu;
  repeated_ = same ? repeated_ + 1 : 0;
  if (!same) varied_ = std::min(varied_ + 1, kVaried);
  if (same && varied_ < kVaried) varied_ = 0;
  const bool stuck = repeated_ >= kStuck && varied_ >= kVaried;
  const bool weightless = imu.delta_v.norm() < kLeastForce_mps2 * seconds(imu.interval);
  weightless_ = weightless ? weightless_ + 1 : 0;
  return !stuck && !imu.delta_v.isZero(0.0) && weightless_ < kWeightless;
}

}  // namespace rcs::wm
