#pragma once
// A smooth motion of the vehicle: uniform cumulative cubic B-spline on R^3 x SO(3).

#include <vector>

#include "rcs/base/pose.h"

namespace rcs::sim {

/// Pose of the vehicle with its exact derivatives.
struct Motion {
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();       ///< [m/s]
  Vec3 a_world = Vec3::Zero();       ///< [m/s^2], without gravity
  Vec3 rate_vehicle = Vec3::Zero();  ///< angular rate of vehicle against world [rad/s]
};

/// Twice continuously differentiable; rates and accelerations are the exact derivatives of the
/// pose, so that a perfect inertial sensor integrates to the pose exactly.
class Trajectory {
 public:
  /// @param knots  control poses, `interval_s` apart, at least 4; the motion approximates them and
  ///   does not interpolate them. It is defined from knot 1 to the last but one.
  Trajectory(std::vector<Pose> knots, double interval_s);

  /// Extends the motion by one interval. The motion defined before is unchanged.
  void append(const Pose& knot);
  /// Frees the knots that are only needed for earlier times; those must not be queried any more.
  void forget_before(double time_s);

  [[nodiscard]] std::size_t knots_kept() const { return knots_.size(); }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  /// @param time_s  clamped to [0, duration_s()]; 0 is knot 1
  [[nodiscard]] Motion at(double time_s) const;
  [[nodiscard]] Pose pose_at(double time_s) const;

 private:
  /// First pose of the four knots, and the position between the second and third.
  struct Segment {
    std::size_t first;  // index into knots_
    double u;
  };
  [[nodiscard]] Segment segment(double time_s) const;

  std::vector<Pose> knots_;
  std::vector<Vec3> turns_;    ///< log of the rotation from knot k to knot k + 1
  std::size_t forgotten_ = 0;  // number of dropped knots
  double interval_s_;
  double duration_s_;
};

}  // namespace rcs::sim
