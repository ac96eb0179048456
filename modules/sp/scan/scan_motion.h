#pragma once
// The vehicle's motion during a scan: from WM's belief and inertial increments, or, without
// inertial input, by constant velocity. It regularizes registration and deskews the scan.

#include <cstddef>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::sp {

/// Inertial increments of one interval, vehicle frame.
struct InertialSample {
  Stamp stamp;  ///< end of the interval
  Duration interval{};
  Vec3 delta_angle_rad;
  Vec3 delta_v_mps;
};

/// Start of the prediction: a belief at one instant, in the frame of the rolling map.
struct MotionState {
  Stamp stamp;
  Pose T_rolling_vehicle;
  Vec3 v_rolling = Vec3::Zero();                ///< [m/s]
  Vec3 gravity_rolling = Vec3(0, 0, -9.80665);  ///< [m/s^2], pointing down
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  Vec3 rate_vehicle_radps = Vec3::Zero();  ///< used where inertial samples are missing
};

/// Fixed-capacity buffer of the latest inertial samples, in order of time.
class InertialBuffer {
 public:
  explicit InertialBuffer(std::size_t capacity);

  /// After this many samples in a row that are not later than the newest, the newest had a wrong
  /// stamp or the clock has stepped: the buffer is cleared.
  static constexpr int kClockStepped = 20;

  /// @return false for a sample that is not later than the newest
  bool add(const InertialSample& sample);
  void clear() { count_ = 0; }
  /// Removes the newest samples in [since, until).
  void discard(Stamp since, Stamp until) {
    const auto wrong = [&](Stamp stamp) { return stamp >= since && stamp < until; };
    while (count_ > 0 && wrong((*this)[count_ - 1].stamp)) --count_;
  }

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] const InertialSample& operator[](std::size_t i) const {  ///< 0: oldest
    return samples_[(head_ + i) % samples_.size()];
  }

 private:
  std::vector<InertialSample> samples_;
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  int refused_ = 0;  // in a row
};

/// The state moved to `stamp` (either direction): strapdown integration where inertial samples
/// cover the time, constant velocity and rate elsewhere.
[[nodiscard]] MotionState propagate(const MotionState& state, const InertialBuffer& inertial,
                                    Stamp stamp);

/// Constant body velocity and rate, as of a vehicle in a turn.
[[nodiscard]] MotionState coast(const MotionState& state, Stamp stamp);

/// Poses at equal steps over a scan, relative to its reference instant.
struct MotionTable {
  Duration first{};  ///< of the first knot, after the reference instant
  Duration step{};
  std::vector<Pose> T_reference_vehicle;
};

/// @param state  near the scan; @param first, last  span of the scan's points after `reference`
void tabulate_motion(const MotionState& state, const InertialBuffer& inertial, Stamp reference,
                     Duration first, Duration last, MotionTable* table);

}  // namespace rcs::sp
