#pragma once
// How a LADAR is turned against the vehicle, and how late its stamps are, from the ground that it
// sees twice.

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

/// What the configured mount and the stamps are off by.
struct MountError {
  Vec3 turn_vehicle = Vec3::Zero();  ///< small rotation about the vehicle's origin [rad]
  double late_s = 0.0;               ///< of the points: taken so much later than their stamps say
};

/// A turned LADAR lifts what is far more than what is near, so that the ground of a cell lies
/// higher or lower from afar than from near by. The heights of the cells themselves are unknowns
/// that are eliminated: only the differences within a cell count. Linear least squares, in one
/// pass.
class MountEstimator {
 public:
  /// @param cell_m  within which the ground is one height above a surface
  explicit MountEstimator(double cell_m) : cell_m_(cell_m) {}

  /// A return of the ground.
  /// @param p_vehicle  the point; @param T_map_vehicle  the vehicle when it was taken
  /// @param twist_vehicle  of the vehicle then, (rho [m/s], phi [rad/s])
  /// @param gradient  of the surface there; @param above_m  of the point above that surface
  /// @param sigma_m  of that height
  void add(const Vec3& p_vehicle, const Pose& T_map_vehicle, const Vec6& twist_vehicle,
           const Vec2& gradient, double above_m, double sigma_m);

  /// What makes the heights agree best. What the ground does not tell stays 0: turns are taken for
  /// N(0, 0.3 deg), lateness for N(0, 10 ms).
  [[nodiscard]] MountError solve() const;

  [[nodiscard]] std::size_t bytes() const { return cells_.bytes(); }

 private:
  using Row = Vec<4>;
  struct Sums {
    double w = 0.0;
    double wr = 0.0;
    Row wJ = Row::Zero();
  };
  double cell_m_;
  CellBlocks<Sums> cells_;
  Eigen::Matrix4d JJ_ = Eigen::Matrix4d::Zero();
  Row Jr_ = Row::Zero();
};

/// T_map_vehicle, as if the mount and the stamps had been right: puts points where they are.
[[nodiscard]] inline Pose corrected(const Pose& T_map_vehicle, const Vec6& twist_vehicle,
                                    const MountError& error) {
  return T_map_vehicle * exp_se3(error.late_s * twist_vehicle) *
         Pose{exp_so3(error.turn_vehicle), Vec3::Zero()};
}

}  // namespace rcs::mapping
