#pragma once
// The normal equations of many pairs, computed eight at a time.

#include <array>
#include <cstddef>

#include "modules/registration/normal_equations.h"

namespace rcs::registration {

/// Sums in float over some hundred pairs, then in double. The same pairs in the same order give the
/// same bits.
class PairSums {
 public:
  PairSums() {
    for (Lane& sum : lanes_) sum.setZero();
  }

  /// See NormalEquations::add().
  /// @param wr  weighted residual
  /// @param w   weight, or its substitute in H
  /// @param wv  weight times the variance of the normal about each axis in its surface [rad^2]
  void add(const Vec3f& p_vehicle, const Vec3f& n_vehicle, float wr, float w, float wv) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      in_[k][filled_] = p_vehicle[axis];
      in_[3 + k][filled_] = n_vehicle[axis];
    }
    in_[6][filled_] = wr;
    in_[7][filled_] = w;
    in_[8][filled_] = wv;
    if (++filled_ == kLanes) flush();
  }

  /// The sums of all pairs; call it once.
  [[nodiscard]] NormalEquations finish();

 private:
  static constexpr int kLanes = 8;
  static constexpr int kFlushes = 32;  // summed in float
  using Lane = Eigen::Array<float, kLanes, 1>;
  // Sums: w J'J, lower triangle by rows; wv J'J likewise; wr J; wv p; wv p p' (xx xy xz yy yz zz);
  // wv; w.
  static constexpr std::size_t kH = 0;
  static constexpr std::size_t kHv = 21;
  static constexpr std::size_t kB = 42;
  static constexpr std::size_t kP = 48;
  static constexpr std::size_t kPp = 51;
  static constexpr std::size_t kV = 57;
  static constexpr std::size_t kW = 58;
  static constexpr std::size_t kSums = 59;

  void flush();
  void fold();

  std::array<Lane, 9> in_;  // of the waiting pairs: p, n, wr, w, wv
  int filled_ = 0;
  int flushes_ = 0;
  std::array<Lane, kSums> lanes_;
  std::array<double, kSums> sums_{};
};

}  // namespace rcs::registration
