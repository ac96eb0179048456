#pragma once
// Generalized ICP (Segal, Haehnel & Thrun, RSS 2009). It is kept for comparison: the vehicle
// registers with point_to_plane_icp.h.

#include <cstdint>
#include <optional>
#include <vector>

#include "modules/registration/registration.h"
#include "rcs/base/kd_tree.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

struct GicpParams {
  double voxel_m = 0.15;  ///< one point of each voxel is used, [0.01, 10]
  int neighbours = 20;    ///< of a point's surface, including itself, [4, 1000]
  /// Closest points farther apart are not paired, at the start, [0.1, 100]. From an initial error
  /// of 3 m and 20 deg, 16 % converge with 2 m, 80 % with 10, 92 % with 20 (frames 5, 15, ... of
  /// the KITTI drive).
  double gate_m = 20.0;
  double min_gate_m = 0.5;      ///< and at the end, [0.01, 100]
  int max_iterations = 60;      ///< [1, 1000]
  int min_pairs = 50;           ///< fewer: kTooFew, [6, 100000]
  double min_move_m = 5e-4;     ///< converged: a step moves by less, [1e-7, 1]
  double min_turn_rad = 5e-5;   ///< and turns by less, [1e-8, 1]
  double min_alignment = 1e-4;  ///< observability below which a direction is unobserved, [0, 0.5]
  double max_sigma_m = 0.5;     ///< a direction with a larger sigma is unobserved, [0.001, 100]
  double max_correction_m = 10.0;   ///< larger distance from the guess: kDiverged, [0.01, 1000]
  double max_correction_rad = 1.0;  ///< likewise, [0.001, 3.2]
};

/// A point and its surface.
struct GicpPoint {
  Vec3 p = Vec3::Zero();
  Vec3 normal = Vec3::Zero();   ///< of either sign; zero: the neighbours lie on a line or coincide
  double angle_variance = 0.0;  ///< of the normal [rad^2]
};

/// A cloud prepared for the method: thinned, with the surface of each point. Its address must not
/// change, because its tree refers to it.
class GicpCloud {
 public:
  /// @param points  [m], finite, within 100 km of the origin
  GicpCloud(const Points& points, const GicpParams& params);
  GicpCloud(const GicpCloud&) = delete;
  GicpCloud& operator=(const GicpCloud&) = delete;

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] const GicpPoint& operator[](std::size_t i) const { return surface_[i]; }
  /// @pre size() > 0
  [[nodiscard]] KdTree::Closest closest(const Vec3f& p) const { return tree_->closest(p); }

 private:
  Points points_;  // one of each voxel
  std::optional<KdTree> tree_;
  std::vector<GicpPoint> surface_;
};

/// Contribution of one pair to the cost, in the frame of the data.
struct GicpTerm {
  Vec3 d = Vec3::Zero();            ///< R'(T p_data - p_model) [m]
  Mat3 M = Mat3::Zero();            ///< (C_data + R' C_model R)^-1 [1/m^2]
  Mat<3, 6> J = Mat<3, 6>::Zero();  ///< of d by the right perturbation of T, with R of d fixed
};
/// A covariance is a disc: 1 m^2 along the surface, 1e-3 m^2 across.
[[nodiscard]] GicpTerm gicp_term(const GicpPoint& data, const GicpPoint& model, const Pose& T);

/// Aligns `data` to `model`: Gauss-Newton on Geman-McClure weighted d' M d (M is fixed in a step),
/// with a gate and a kernel that shrink. Along unobserved directions the guess is kept.
/// @param guess  T_model_data, with an error of at most about 2 m and 10 deg, or it may stop in a
///   local minimum
/// @return with T_target_vehicle = T_model_data, or the guess if it is not usable. information is
///   scaled by the residuals, and excludes the part of M along surfaces, where the closest point
///   follows the data. Pairs are treated as independent: correct for independent noise, far too
///   optimistic for real scans, whose errors are correlated.
/// Deterministic.
[[nodiscard]] Registration register_gicp(const GicpCloud& model, const GicpCloud& data,
                                         const Pose& guess, const GicpParams& params);
[[nodiscard]] Registration register_gicp(const Points& model, const Points& data, const Pose& guess,
                                         const GicpParams& params);

}  // namespace rcs::registration
