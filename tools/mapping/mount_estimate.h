#pragma once
// Estimates the LADAR misalignment and the error of its stamps from ground that is observed
// repeatedly.

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

/// Errors of the configured mount and of the stamps.
struct MountError {
  Vec3 turn_vehicle = Vec3::Zero();  ///< small rotation about the vehicle's origin [rad]
  double late_s = 0.0;               ///< delay of the measurements against their stamps
};

/// A misaligned LADAR raises far ground more than near ground, so that the height of a cell depends
/// on the range. The heights of the cells are eliminated: only differences within a cell are used.
/// Linear least squares in one pass.
class MountEstimator {
 public:
  /// @param cell_m  size of cells with a constant height above a surface
  explicit MountEstimator(double cell_m) : cell_m_(cell_m) {}

  /// Adds a return of the ground.
  /// @param p_vehicle  the point; @param T_map_vehicle  the vehicle at its time
  /// @param twist_vehicle  of the vehicle then, (rho [m/s], phi [rad/s])
  /// @param gradient  of the surface there; @param above_m  of the point above that surface
  /// @param sigma_m  of that height
  void add(const Vec3& p_vehicle, const Pose& T_map_vehicle, const Vec6& twist_vehicle,
           const Vec2& gradient, double above_m, double sigma_m);

  /// The errors with the best agreement of the heights. Unobserved ones stay 0, by the priors
  /// N(0, 0.3 deg) of the rotation and N(0, 10 ms) of the delay.
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
