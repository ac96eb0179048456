#pragma once
// Slopes of a map that are errors of its heights: they are not information about a position
// (docs/adr/0045-slopes-from-map-errors.md).

#include <Eigen/Eigenvalues>

#include "rcs/base/linear.h"

namespace rcs {

/// Variance of each component of a cell's gradient, from independent errors of its four corners,
/// averaged over the cell.
/// @param sigma_m  of a height
[[nodiscard]] inline double gradient_variance(double sigma_m, double cell_m) {
  return 4.0 / 3.0 * (sigma_m / cell_m) * (sigma_m / cell_m);
}

/// Errors of the normals cause apparent slopes: of H = G + V, with V by noise, the estimate's
/// covariance is G^-1 (G + V) G^-1. Returns its inverse, zero in directions without information. A
/// scan has 40 to 100 slopes, so that V is known to 10 to 20 %. It counts 1.4 times, or else a part
/// of it would be information in match after match (docs/adr/0110-noise-of-map-slopes.md).
/// @param H  symmetric, positive semidefinite
/// @param V  the same; its lower triangle is used
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, N> without_noise(const Eigen::Matrix<double, N, N>& H,
                                                        const Eigen::Matrix<double, N, N>& V) {
  using Square = Eigen::Matrix<double, N, N>;
  using Column = Eigen::Matrix<double, N, 1>;
  // In coordinates in which H is the identity, G is the share of each direction without noise.
  const Eigen::SelfAdjointEigenSolver<Square> of_H(H);
  const Column root = of_H.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const Column per_root = (root.array() > 1e-9 * root.maxCoeff()).select(root.cwiseInverse(), 0.0);
  const Square whiten = of_H.eigenvectors() * per_root.asDiagonal();
  const Square colour = of_H.eigenvectors() * root.asDiagonal();
  const Square noise_part =
      whiten.transpose() * V.template selfadjointView<Eigen::Lower>() * whiten;
  const Eigen::SelfAdjointEigenSolver<Square> noise(noise_part);
  constexpr double kCertain = 1.4;
  const Column left = (1.0 - kCertain * noise.eigenvalues().array()).max(0.0).square();
  const Square out = colour * noise.eigenvectors();
  return out * left.asDiagonal() * out.transpose();
}

}  // namespace rcs
