#pragma once
// The share of a scan that usually matches the rolling map, and the limit below which a share is
// unusual here: between walls it varies by thousandths, in grass by tenths.

#include <algorithm>
#include <cmath>

namespace rcs::sp {

class UsualOverlap {
 public:
  /// @param overlap  of a registered scan, [0, 1]
  void add(double overlap) {
    constexpr double kLowPass = 0.1;
    const double weight = std::max(kLowPass, 1.0 / ++scans_);
    if (scans_ > 1) deviation_ += weight * (std::abs(overlap - mean_) - deviation_);
    mean_ += weight * (overlap - mean_);
  }
  /// Of another map.
  void forget() { *this = {}; }

  [[nodiscard]] double mean() const { return mean_; }  ///< 0: none yet

  /// A scan that matches less may be wrongly placed: a metre along a street costs it a seventh of
  /// its matches (docs/experiments/registration/recovery.md).
  [[nodiscard]] double least() const {
    constexpr int kKnown = 10;
    constexpr double kDeviations = 5.0;
    constexpr double kMin = 0.05;
    constexpr double kMax = 0.2;
    const double varies = scans_ < kKnown ? kMax * mean_ : kDeviations * deviation_;
    return mean_ - std::clamp(varies, kMin * mean_, kMax * mean_);
  }

 private:
  int scans_ = 0;
  double mean_ = 0.0;
  double deviation_ = 0.0;  // mean of the absolute deviations
};

}  // namespace rcs::sp
