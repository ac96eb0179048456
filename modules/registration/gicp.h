#pragma once
// Generalized ICP (Segal, Haehnel & Thrun, RSS 2009). It is kept to be compared with: the vehicle
// registers by icp.h.

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
  double voxel_m = 0.15;  ///< of each cloud one point a voxel is used, [0.01, 10]
  int neighbours = 20;    ///< of a point's surface, itself among them, [4, 1000]
  /// Closest points farther apart are no pair, at the start, [0.1, 100]. From 3 m and 20 deg off
  /// 16 % arrive with 2 m, 80 % with 10, 92 % with 20 (frames 5, 15, ... of the KITTI drive).
  double gate_m = 20.0;
  double least_gate_m = 0.5;     ///< and in the end, [0.01, 100]
  int max_iterations = 60;       ///< [1, 1000]
  int min_pairs = 50;            ///< fewer: kTooFew, [6, 100000]
  double least_move_m = 5e-4;    ///< converged: a step moves by less, [1e-7, 1]
  double least_turn_rad = 5e-5;  ///< and turns by less, [1e-8, 1]
  double min_alignment = 1e-4;   ///< observability below which a direction is unobserved, [0, 0.5]
  double max_sigma_m = 0.5;      ///< a direction known no better is unobserved, [0.001, 100]
  double max_correction_m = 10.0;   ///< farther from the guess: kDiverged, [0.01, 1000]
  double max_correction_rad = 1.0;  ///< likewise, [0.001, 3.2]
};

/// A point and the surface that it is of.
struct GicpPoint {
  Vec3 p = Vec3::Zero();
  Vec3 normal = Vec3::Zero();   ///< either way; zero: its neighbours lie on a line or are one
  double angle_variance = 0.0;  ///< of the normal [rad^2]
};

/// A cloud as the method sees it: thinned, with the surface of each point. It stays where it is, as
/// its tree does.
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
  Points points_;  // one a voxel
  std::optional<KdTree> tree_;
  std::vector<GicpPoint> surface_;
};

/// What one pair adds to the sum that is made least, in the frame of the data.
struct GicpTerm {
  Vec3 d = Vec3::Zero();            ///< R'(T p_data - p_model) [m]
  Mat3 M = Mat3::Zero();            ///< (C_data + R' C_model R)^-1 [1/m^2]
  Mat<3, 6> J = Mat<3, 6>::Zero();  ///< of d by the right perturbation of T, R of d held
};
/// A covariance is a disc: 1 m^2 along the surface, 1e-3 m^2 across.
[[nodiscard]] GicpTerm gicp_term(const GicpPoint& data, const GicpPoint& model, const Pose& T);

/// Aligns `data` to `model`: Gauss-Newton on Geman-McClure weighted d' M d (M is held in a step),
/// with a gate and a kernel that shrink. Along unobserved directions the guess is kept.
/// @param guess  T_model_data, off by no more than about 2 m and 10 deg, or it may stop in a local
///   minimum
/// @return with T_target_vehicle = T_model_data, the guess where it is not usable. information is
///   scaled by what the residuals are, and leaves out what M claims along surfaces, where the
///   closest point follows the data. Pairs count as independent: right for independent noise, far
///   too sure for real scans, whose errors go together.
/// Deterministic.
[[nodiscard]] Registration register_gicp(const GicpCloud& model, const GicpCloud& data,
                                         const Pose& guess, const GicpParams& params);
[[nodiscard]] Registration register_gicp(const Points& model, const Points& data, const Pose& guess,
                                         const GicpParams& params);

}  // namespace rcs::registration
