#include "modules/registration/registration.h"

#include <Eigen/Cholesky>
#include <array>

namespace rcs::registration {

template <int kBytes>
const char BuiltWithAlignment<kBytes>::symbol = 0;
template struct BuiltWithAlignment<EIGEN_MAX_ALIGN_BYTES>;

std::string_view name_of(Stop stop) {
  constexpr std::array<std::string_view, 10> kNames = {
      "converged",  "max iterations", "budget",   "limit cycle", "too few",
      "degenerate", "empty",          "diverged", "seeded",      "held"};
  const auto at = static_cast<std::size_t>(stop);
  return at < kNames.size() ? kNames[at] : "unknown";
}

Mat6 with_distortion(const Mat6& information, const Mat6& distortion) {
  const Mat6 total = information + distortion.ldlt().solve(Mat6::Identity());
  const Mat6 out = information - information * total.ldlt().solve(information);
  return 0.5 * (out + out.transpose());
}

Pose fused_pose(const Prediction& prediction, const Registration& registration) {
  const Pose& T = registration.T_target_vehicle;
  const Mat6 prior = prediction.covariance.ldlt().solve(Mat6::Identity());
  const Vec6 to_prediction = log_se3(T.inverse() * prediction.T_target_vehicle);
  const Mat6 total = registration.information + prior;
  return T * exp_se3(total.ldlt().solve(prior * to_prediction));
}

}  // namespace rcs::registration
