#pragma once
// Errors of an estimated trajectory: absolute error after alignment (Sturm et al. 2012), relative
// error over driven lengths (Geiger et al. 2012), and consistency (NEES).

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "tools/base/statistics.h"

namespace rcs::evaluation {

/// Poses T_frame_vehicle at the same instants; the two frames may differ.
struct PosePairs {
  std::vector<Stamp> stamps;
  std::vector<Pose> estimate;
  std::vector<Pose> truth;

  [[nodiscard]] std::size_t size() const { return stamps.size(); }
};

enum class Alignment {
  kNone,   ///< the frames are the same
  kFirst,  ///< the first poses coincide
  kYaw,    ///< least squares over position and yaw, which are unobserved without GPS
  kRigid   ///< least squares over SE(3)
};

/// T_truth_estimate that minimizes the squared distances of the positions (Umeyama 1991 without
/// scale). Identity without pairs.
[[nodiscard]] Pose align(const PosePairs& pairs, Alignment alignment);

/// Errors of poses after `T_truth_estimate` is applied.
struct AbsoluteError {
  tools::Summary translation_m;
  tools::Summary horizontal_m;
  tools::Summary vertical_m;  ///< magnitudes
  tools::Summary rotation_rad;
};
[[nodiscard]] AbsoluteError absolute_error(const PosePairs& pairs, const Pose& T_truth_estimate);

/// Errors of the motions over segments of one length.
struct RelativeError {
  double length_m = 0.0;  ///< requested, of distance driven; 0: by frames
  int frames = 0;         ///< requested; 0: by length
  std::size_t segments = 0;
  double driven_m = 0.0;             ///< mean length of the segments, by the truth
  double translation_m = 0.0;        ///< mean
  double translation_percent = 0.0;  ///< sum of errors over sum of driven lengths, finite at rest
  double rotation_rad = 0.0;         ///< mean
  double rotation_rad_per_m = 0.0;   ///< sum over sum, as translation_percent
};
/// Every pair begins a segment that ends at the first pair after at least `length_m`.
[[nodiscard]] RelativeError relative_error_over_length(const PosePairs& pairs, double length_m);
[[nodiscard]] RelativeError relative_error_over_frames(const PosePairs& pairs, int frames);

/// 100, 200, ... 800 m as in KITTI as far as they fit; for courses under 100 m 5, 10, 20, 50 m.
[[nodiscard]] std::vector<double> lengths_that_fit(double driven_m);

/// Error of the motion from the first pair to the last, in percent of the distance driven.
[[nodiscard]] double drift_percent(const PosePairs& pairs);

/// Error of `estimate` in the coordinates of its covariance: the right perturbation (rho, phi) with
/// truth = estimate * exp(xi).
[[nodiscard]] Vec6 pose_error(const Pose& estimate, const Pose& truth);

/// xi^T P^-1 xi: expected value 6 if P is consistent. nullopt if P is not positive definite.
[[nodiscard]] std::optional<double> nees(const Vec6& xi, const Mat6& P);

}  // namespace rcs::evaluation
