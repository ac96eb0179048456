#include "tools/studies/match_starts.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace rcs::studies {
namespace {

constexpr double kChiSquare95 = 5.991;  // 2 degrees of freedom
constexpr WorkUnits kUnlimited = std::numeric_limits<WorkUnits>::max() / 2;

/// Up, roll and pitch as for a vehicle with a known vertical.
Mat6 covariance_of(const MatchStarts& starts) {
  Vec6 sigma;
  sigma << starts.max_distance_m, starts.max_distance_m, 1.0, 0.02, 0.02, starts.max_heading_rad;
  return sigma.cwiseMax(1e-3).cwiseAbs2().asDiagonal();
}

Vec2 median_of(const std::vector<Pose>& poses) {
  std::vector<double> x, y;
  for (const Pose& T : poses) {
    x.push_back(T.p.x());
    y.push_back(T.p.y());
  }
  const auto median = [](std::vector<double>* v) {
    const auto at = v->begin() + static_cast<std::ptrdiff_t>(v->size() / 2);
    std::nth_element(v->begin(), at, v->end());
    return *at;
  };
  return {median(&x), median(&y)};
}

void count(MatchEnds* ends) {
  if (ends->poses.empty()) return;
  const Vec2 middle = median_of(ends->poses);
  const auto off = [&](std::size_t k) { return (ends->poses[k].p.head<2>() - middle).norm(); };
  for (std::size_t k = 0; k < ends->poses.size(); ++k) {
    if (off(k) <= MatchEnds::kSamePlace_m) ++ends->converged;
    if (off(k) < off(ends->nearest)) ends->nearest = k;
  }
}

}  // namespace

Eigen::Matrix2d MatchEnds::plane() const {
  // Right perturbation: the translation is in the vehicle's axes.
  const Mat3 R = poses[nearest].rotation();
  return (R * covariance[nearest].topLeftCorner<3, 3>() * R.transpose()).topLeftCorner<2, 2>();
}

bool MatchEnds::inside(const Vec2& place_m) const {
  const Vec2 off = poses[nearest].p.head<2>() - place_m;
  return off.dot(plane().inverse() * off) <= kChiSquare95;
}

MatchEnds match_from_starts(const sp::PriorScan& scan, const ElevationMap& map,
                            const Pose& T_map_vehicle, const MatchStarts& starts,
                            const sp::PriorMatchParams& params,
                            const std::function<void(int)>& progress) {
  sp::PriorMatchWorkspace workspace;
  registration::Prediction prediction;
  prediction.covariance = covariance_of(starts);
  std::mt19937_64 rng(starts.seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatchEnds ends;
  for (int k = 0; k < starts.starts; ++k) {
    progress(k);
    const double bearing = kPi * uniform(rng);
    const double off_m = starts.max_distance_m * std::sqrt(std::abs(uniform(rng)));
    Vec6 turn = Vec6::Zero();
    turn[5] = starts.max_heading_rad * uniform(rng);
    prediction.T_target_vehicle = T_map_vehicle * exp_se3(turn);
    prediction.T_target_vehicle.p += off_m * Vec3(std::cos(bearing), std::sin(bearing), 0.0);
    const registration::Registration r = match_prior_map(scan.ground(), scan.standing(), map,
                                                         prediction, params, kUnlimited, &workspace)
                                             .registration;
    ends.iterations += static_cast<double>(r.iterations) / starts.starts;
    ends.used += static_cast<double>(r.used) / starts.starts;
    if (!registration::usable(r.stop) || r.stop == registration::Stop::kDegenerate) {
      ++ends.refused;
      continue;
    }
    ends.poses.push_back(r.T_target_vehicle);
    ends.covariance.push_back(r.information.ldlt().solve(Mat6::Identity()));
  }
  count(&ends);
  return ends;
}

}  // namespace rcs::studies
