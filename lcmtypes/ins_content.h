#pragma once
// Detects increments that no working INS measures: the same values again and again, an axis at the
// end of its range, or a specific force that is missing or does not point upwards. WM and SP treat
// such a sample as if it had not been received.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "lcmtypes/rcs/ins_t.hpp"

namespace rcs {

/// Why a sample of the INS is not a measurement.
enum class InsFault { kNone, kFrozen, kNoForce, kNotUpward, kSaturated };

[[nodiscard]] constexpr std::string_view name_of(InsFault fault) {
  constexpr std::string_view kNames[] = {
      "no fault", "eight equal increments in a row (frozen sensor)", "no specific force",
      "specific force not upward", "six equal values of an axis in a row (saturated)"};
  return kNames[static_cast<std::size_t>(fault)];
}

class InsContent {
 public:
  /// @param m  in the order of reception
  /// @return other than kNone: the sample is not a measurement, nor are those before it with stamps
  ///   from wrong_since() on
  [[nodiscard]] InsFault add(const ins_t& m) {
    bool same = m.utime != last_.utime;
    bool zero = true;
    for (int i = 0; i < 3; ++i) {
      same = same && m.delta_angle_rad[i] == last_.delta_angle_rad[i] &&
             m.delta_v_mps[i] == last_.delta_v_mps[i];
      zero = zero && m.delta_v_mps[i] == 0.0;
    }
    repeated_.add(same, m.utime);
    if (!same) varied_ = std::min(varied_ + 1, kVaried);
    if (same && varied_ < kVaried) varied_ = 0;
    const bool stuck = repeated_.count >= kStuck && varied_ >= kVaried;

    // What is not finite is rejected by plausible().
    const double interval_s = 1e-6 * std::max(m.interval_us, 1);
    const double share = last_.utime == 0 ? 1.0 : std::min(1.0, interval_s / kMean_s);
    double force_mps2 = 0.0;
    double mean_mps2 = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double of_axis_mps2 = m.delta_v_mps[i] / interval_s;
      double& mean = mean_force_mps2_[static_cast<std::size_t>(i)];
      if (std::isfinite(of_axis_mps2)) mean += share * (of_axis_mps2 - mean);
      force_mps2 = std::hypot(force_mps2, of_axis_mps2);
      mean_mps2 = std::hypot(mean_mps2, mean);
    }
    weightless_.add(force_mps2 < kMinForce_mps2, m.utime);
    tilted_.add(m.delta_v_mps[2] / interval_s < kMinUpward * force_mps2, m.utime);
    if (mean_mps2 > kDirected_mps2) {
      const double upward = mean_force_mps2_[2] / mean_mps2;
      if (upward < kMinUpward) upright_s_ = 0.0;
      upright_s_ = upward < kUpright && upright_s_ < kUprightFor_s ? 0.0 : upright_s_ + interval_s;
    }
    bool saturated = false;
    for (std::size_t i = 0; i < 3; ++i) {
      const double last_s = 1e-6 * std::max(last_.interval_us, 1);
      const bool rate = gyro_[i].add(m.delta_angle_rad[i] / interval_s,
                                     last_.delta_angle_rad[i] / last_s, kTurning_radps);
      const bool force =
          accel_[i].add(m.delta_v_mps[i] / interval_s, last_.delta_v_mps[i] / last_s, kForce_mps2);
      saturated = saturated || (!same && (rate || force));
    }
    last_ = m;
    wrong_since_ = m.utime;
    if (stuck) {
      wrong_since_ = repeated_.since;
      return InsFault::kFrozen;
    }
    if (zero || weightless_.count >= kWeightless) {
      wrong_since_ = weightless_.since;
      return InsFault::kNoForce;
    }
    if (upright_s_ < kUprightFor_s) {
      wrong_since_ = tilted_.since;
      return InsFault::kNotUpward;
    }
    return saturated ? InsFault::kSaturated : InsFault::kNone;
  }

  /// Of the newest sample, if it is plausible and no measurement [us]: the fault began then, before
  /// it was certain. At most 0.3 s before its stamp: a wrong stamp must not discard more.
  [[nodiscard]] std::int64_t wrong_since() const {
    constexpr std::int64_t kLongest_us = 300'000;
    return last_.utime < kLongest_us ? last_.utime
                                     : std::max(wrong_since_, last_.utime - kLongest_us);
  }

 private:
  /// Samples in a row of which something holds, and the stamp of the first one.
  struct Run {
    int count = 0;
    std::int64_t since = 0;

    void add(bool holds, std::int64_t utime) {
      count = holds ? count + 1 : 0;
      if (count <= 1) since = utime;
    }
  };

  /// An axis repeats a large value exactly: its noise is cut off at the end of its range.
  struct Axis {
    int varied = 0;    ///< values in a row that differed from the one before, until kVaried
    int repeated = 0;  ///< in a row

    bool add(double value, double before, double least) {
      const bool same = std::abs(value - before) <= 1e-9 * std::abs(value);
      repeated = same ? repeated + 1 : 0;
      if (!same) varied = std::min(varied + 1, kVaried);
      if (same && varied < kVaried) varied = 0;
      return repeated >= kSaturated && varied >= kVaried && std::abs(value) > least;
    }
  };

  // A real sensor has noise. A sensor without noise (a simulation) repeats its values at rest and
  // on a straight line, so repetition counts only after values that have varied for some time.
  static constexpr int kVaried = 100;
  static constexpr int kStuck = 8;
  // A coarse converter repeats one value in twenty, and six in a row a few times a day. A single
  // sample is then missing, which the filter bridges.
  static constexpr int kSaturated = 5;
  static constexpr double kTurning_radps = 0.05;  ///< no range is smaller
  static constexpr double kForce_mps2 = 9.9;      ///< nor below gravity
  static constexpr int kWeightless = 8;
  static constexpr double kMinForce_mps2 = 1.0;  ///< a vehicle in the air falls only for a moment
  // More than 60 degrees from the vehicle's z axis. Exchanged axes or an inverted one move the
  // filter by five metres in the first second, before any other test can know. A small force has no
  // such direction: on rough ground a vehicle is nearly weightless for a tenth of a second.
  static constexpr double kMinUpward = 0.5;  ///< component along z over the whole
  static constexpr double kUpright = 0.8;    ///< for a second, until it is accepted again
  static constexpr double kUprightFor_s = 1.0;
  static constexpr double kDirected_mps2 = 6.0;
  static constexpr double kMean_s = 0.1;

  ins_t last_{};
  int varied_ = 0;  ///< samples in a row that differed from the one before, until kVaried
  Run repeated_;
  Run weightless_;
  Run tilted_;  ///< a force that does not point upwards
  std::int64_t wrong_since_ = 0;
  double upright_s_ = kUprightFor_s;
  std::array<Axis, 3> gyro_{}, accel_{};
  std::array<double, 3> mean_force_mps2_{};  ///< low-passed specific force, vehicle axes
};

}  // namespace rcs
