#include "modules/registration/agreement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace rcs::registration {

Agreement agreement(RollingMap* model, RollingMap* data, const Points& points,
                    const Pose& T_model_data, const AgreementParams& params) {
  const Mat3f R = T_model_data.rotation().cast<float>();
  const Vec3f t = T_model_data.p.cast<float>();
  const auto tolerance = static_cast<float>(params.tolerance_m);
  const auto min_cosine = static_cast<float>(std::cos(params.tolerance_rad));
  Agreement out;
  int fitting = 0;
  Mat3 all = Mat3::Zero();
  Mat3 fit = Mat3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    Surface own{};
    if (!data->nearest_surface(points[i], &own)) continue;
    if (std::abs(own.normal.dot(points[i] - own.mean)) > tolerance) continue;
    const Vec3 n = own.normal.cast<double>();
    ++out.surfaces;
    all += n * n.transpose();
    const Vec3f q = R * points[i] + t;
    Surface other{};
    if (!model->nearest_surface(q, &other)) continue;
    if (std::abs(other.normal.dot(q - other.mean)) > tolerance) continue;
    if (std::abs(other.normal.dot(R * own.normal)) < min_cosine) continue;
    ++fitting;
    fit += n * n.transpose();
  }
  if (out.surfaces == 0) return out;
  out.overlap = static_cast<double>(fitting) / out.surfaces;
  // The smallest v' fit v / v' all v over the directions v that have surfaces.
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(all / out.surfaces);
  Mat3 whitening = Mat3::Zero();
  int judged = 0;
  for (int k = 2; k >= 0 && axes.eigenvalues()[k] > params.min_variety; --k, ++judged) {
    whitening.col(judged) = axes.eigenvectors().col(k) / std::sqrt(axes.eigenvalues()[k]);
  }
  if (judged < 3) out.undetermined = axes.eigenvectors().col(0);
  if (judged == 0) return out;
  const Mat3 shares = whitening.transpose() * (fit / out.surfaces) * whitening;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> share(shares.topLeftCorner(judged, judged));
  out.least = std::clamp(share.eigenvalues()[0], 0.0, 1.0);
  return out;
}

}  // namespace rcs::registration
