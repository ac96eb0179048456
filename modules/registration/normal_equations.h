#pragma once
// The 6 x 6 normal equations of residuals along surface normals, and the resulting step.

#include "modules/registration/registration.h"
#include "rcs/base/linear.h"

namespace rcs::registration {

/// Sums over residuals r with Jacobian J and weight w: H = sum w J'J, b = sum w J'r.
struct NormalEquations {
  Mat6 H = Mat6::Zero();  ///< lower triangle while summing; full after close()
  Vec6 b = Vec6::Zero();
  double weight = 0.0;  ///< sum of w
  /// The part of H due to errors of the normals: a normal is known to within an angle, and on flat
  /// ground these errors appear as slopes (sum w E[dJ'dJ]). Zero where add() is used.
  Mat6 noise = Mat6::Zero();

  /// Residual along the normal at a point of the vehicle frame:
  /// r(T exp(xi)) = r + n . rho + (p x n) . phi, with p and n in the vehicle frame.
  void add(const Vec3& p_vehicle, const Vec3& n_vehicle, double residual_m, double w) {
    Vec6 J;
    J << n_vehicle, p_vehicle.cross(n_vehicle);
    H.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
    b += (w * residual_m) * J;
    weight += w;
  }
  void close() {
    H.triangularView<Eigen::Upper>() = H.transpose();
    noise.triangularView<Eigen::Upper>() = noise.transpose();
  }
};

/// Directions sorted by the information of the residuals.
struct Observability {
  /// Ascending. Mean squared; above 1 where a rotation and a translation are coupled.
  Vec6 alignment = Vec6::Zero();
  Mat6 directions = Mat6::Identity();  ///< columns, in coordinates (rho, length * phi)
  /// Factor on what the residuals say about a direction: less the slopes that the errors of the
  /// normals pretend. 1 without such errors, 0 where the direction becomes unobserved.
  Vec6 weight = Vec6::Ones();
  double length_m = 1.0;  ///< makes rotations comparable to translations
  int unobserved = 6;     ///< number of leading columns that are unobserved
};

/// A direction counts as unobserved if its alignment is below `min_alignment`, if less than half of
/// it remains without the errors of the normals, or if its standard deviation would exceed
/// `max_sigma_m` (rotations: at `length_m`).
[[nodiscard]] Observability observability(const NormalEquations& sums, double min_alignment,
                                          double max_sigma_m);

/// Gauss-Newton step along observed directions; along the others the step returns to the
/// prediction.
/// @param to_prediction  log(T^-1 * T_prediction)
/// @param prior_information  of the prediction, right perturbation; what it has in two observed
///   directions in common is neglected
[[nodiscard]] Vec6 observed_step(const NormalEquations& sums, const Observability& obs,
                                 const Vec6& to_prediction,
                                 const Mat6& prior_information = Mat6::Zero());

/// Gauss-Newton step with the prediction as a prior: for the first iterations, while matches are
/// still wrong.
/// @param prior_information  of the prediction, right perturbation
[[nodiscard]] Vec6 steered_step(const NormalEquations& sums, const Mat6& prior_information,
                                const Vec6& to_prediction);

/// `information` with the unobserved directions removed, and the others as far as they are trusted.
[[nodiscard]] Mat6 observed_part(const Mat6& information, const Observability& obs);

}  // namespace rcs::registration
