#include "modules/registration/normal_equations.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace rcs::registration {
namespace {

// A direction is unobserved if the errors of the normals make up more than 1 / kNoise of it.
constexpr double kNoise = 2.0;

// Coordinates (rho, length * phi) -> (rho, phi).
Vec6 scale_of(double length_m) {
  Vec6 s;
  s << 1.0, 1.0, 1.0, 1.0 / length_m, 1.0 / length_m, 1.0 / length_m;
  return s;
}

}  // namespace

Observability observability(const NormalEquations& sums, double min_alignment, double max_sigma_m) {
  Observability obs;
  const double translation = sums.H.topLeftCorner<3, 3>().trace();
  if (!(sums.weight > 0.0) || !(translation > 0.0)) return obs;
  // The length at which a rotation moves the points, along their normals, as much as a translation.
  obs.length_m = std::max(1e-3, std::sqrt(sums.H.bottomRightCorner<3, 3>().trace() / translation));
  const Vec6 s = scale_of(obs.length_m);
  const Mat6 scaled = s.asDiagonal() * sums.H * s.asDiagonal() / sums.weight;
  const Mat6 noise = s.asDiagonal() * sums.noise * s.asDiagonal() / sums.weight;
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(scaled);
  obs.alignment = eigen.eigenvalues().cwiseMax(0.0);
  obs.directions = eigen.eigenvectors();
  const double weakest = std::max(min_alignment, 1.0 / (max_sigma_m * max_sigma_m * sums.weight));
  obs.unobserved = 0;
  for (int k = 0; k < 6; ++k) {
    const Vec6 direction = obs.directions.col(k);
    const double by_noise = direction.dot(noise * direction);
    // Ascending: all weaker directions are unobserved with it.
    if (obs.alignment[k] < std::max(weakest, kNoise * by_noise)) obs.unobserved = k + 1;
    obs.weight[k] = std::max(0.0, 1.0 - kNoise * by_noise / std::max(obs.alignment[k], 1e-300));
  }
  return obs;
}

Vec6 observed_step(const NormalEquations& sums, const Observability& obs, const Vec6& to_prediction,
                   const Mat6& prior_information) {
  const Vec6 s = scale_of(obs.length_m);
  const double weight = std::max(sums.weight, 1e-300);
  const Vec6 gradient = s.cwiseProduct(sums.b) / weight;
  const Mat6 prior = s.asDiagonal() * prior_information * s.asDiagonal() / weight;
  const Vec6 back = to_prediction.cwiseQuotient(s);
  Vec6 step = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vec6 direction = obs.directions.col(k);
    const double held = direction.dot(prior * direction);
    const double along =
        k < obs.unobserved
            ? direction.dot(back)
            : (held * direction.dot(back) - direction.dot(gradient)) / (obs.alignment[k] + held);
    step += along * direction;
  }
  return s.cwiseProduct(step);
}

Vec6 steered_step(const NormalEquations& sums, const Mat6& prior_information,
                  const Vec6& to_prediction) {
  const Mat6 H = sums.H + prior_information;
  return H.ldlt().solve(prior_information * to_prediction - sums.b);
}

Mat6 observed_part(const Mat6& information, const Observability& obs) {
  if (obs.unobserved == 0 && obs.weight.minCoeff() == 1.0) return information;
  if (obs.unobserved == 6) return Mat6::Zero();
  // Fixing the unobserved directions at the prediction would overestimate the information of the
  // others: they are marginalized out (Schur complement).
  const Vec6 s = scale_of(obs.length_m);
  const Mat6 B = s.cwiseInverse().asDiagonal() * obs.directions;  // new basis, inverse transpose
  const Mat6 V = s.asDiagonal() * obs.directions;
  const Mat6 local = V.transpose() * information * V;
  const int u = obs.unobserved;
  const int o = 6 - u;
  // Directions without information share almost none: a floor keeps the inverse finite.
  Mat6 joined = Mat6::Zero();
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;  // on the stack
  joined.bottomRightCorner(o, o) = local.bottomRightCorner(o, o);
  if (u > 0) {
    Block uu = local.topLeftCorner(u, u);
    const Block uo = local.topRightCorner(u, o);
    uu.diagonal().array() += 1e-9 * local.trace() + 1e-12;
    joined.bottomRightCorner(o, o) -= uo.transpose() * uu.ldlt().solve(uo);
  }
  joined = obs.weight.asDiagonal() * joined * obs.weight.asDiagonal();
  return B * joined * B.transpose();
}

}  // namespace rcs::registration
