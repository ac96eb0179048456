#include "tools/evaluation/trajectory_error.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include "tools/base/trajectory.h"

namespace rcs::evaluation {
namespace {

double angle(const Quat& q) { return log_so3(q).norm(); }

/// Error of the motion from pair i to pair j, in the vehicle frame at j.
Pose motion_error(const PosePairs& pairs, std::size_t i, std::size_t j) {
  const Pose T_truth = pairs.truth[i].inverse() * pairs.truth[j];
  const Pose T_estimate = pairs.estimate[i].inverse() * pairs.estimate[j];
  return T_truth.inverse() * T_estimate;
}

struct SegmentSums {
  RelativeError mean;

  void add(const PosePairs& pairs, std::size_t i, std::size_t j, double driven_m) {
    const Pose error = motion_error(pairs, i, j);
    ++mean.segments;
    mean.driven_m += driven_m;
    mean.translation_m += error.p.norm();
    mean.rotation_rad += angle(error.q);
  }

  [[nodiscard]] RelativeError result() const {
    RelativeError r = mean;
    if (r.segments == 0) return r;
    if (r.driven_m > 0.0) {
      r.translation_percent = 100.0 * r.translation_m / r.driven_m;
      r.rotation_rad_per_m = r.rotation_rad / r.driven_m;
    }
    const double n = static_cast<double>(r.segments);
    for (double* sum : {&r.driven_m, &r.translation_m, &r.rotation_rad}) *sum /= n;
    return r;
  }
};

}  // namespace

Pose align(const PosePairs& pairs, Alignment alignment) {
  const std::size_t n = pairs.size();
  if (n == 0 || alignment == Alignment::kNone) return {};
  if (alignment == Alignment::kFirst) return pairs.truth[0] * pairs.estimate[0].inverse();

  Vec3 mean_estimate = Vec3::Zero();
  Vec3 mean_truth = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    mean_estimate += pairs.estimate[i].p / static_cast<double>(n);
    mean_truth += pairs.truth[i].p / static_cast<double>(n);
  }
  Mat3 H = Mat3::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    H += (pairs.truth[i].p - mean_truth) * (pairs.estimate[i].p - mean_estimate).transpose();
  }

  Quat q;
  if (alignment == Alignment::kYaw) {
    const double yaw_rad = std::atan2(H(1, 0) - H(0, 1), H(0, 0) + H(1, 1));
    q = exp_so3(Vec3(0.0, 0.0, yaw_rad));
  } else {
    const Eigen::JacobiSVD<Mat3> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vec3 sign = Vec3::Ones();
    // Without this the best orthogonal matrix may be a reflection (Umeyama 1991, eq. 39).
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) sign.z() = -1.0;
    const Mat3 R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    q = Quat(R).normalized();
  }
  return {q, mean_truth - q * mean_estimate};
}

AbsoluteError absolute_error(const PosePairs& pairs, const Pose& T_truth_estimate) {
  std::vector<double> translation_m;
  std::vector<double> horizontal_m;
  std::vector<double> vertical_m;
  std::vector<double> rotation_rad;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pose moved = T_truth_estimate * pairs.estimate[i];
    const Vec3 d = moved.p - pairs.truth[i].p;
    translation_m.push_back(d.norm());
    horizontal_m.push_back(d.head<2>().norm());
    vertical_m.push_back(std::abs(d.z()));
    rotation_rad.push_back(angle(pairs.truth[i].q.conjugate() * moved.q));
  }
  return {tools::summarize(std::move(translation_m)), tools::summarize(std::move(horizontal_m)),
          tools::summarize(std::move(vertical_m)), tools::summarize(std::move(rotation_rad))};
}

RelativeError relative_error_over_length(const PosePairs& pairs, double length_m) {
  const std::vector<double> driven_m = tools::distances(pairs.truth);
  SegmentSums sums;
  sums.mean.length_m = length_m;
  std::size_t end = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (end < pairs.size() && driven_m[end] - driven_m[i] < length_m) ++end;
    if (end == pairs.size()) break;
    sums.add(pairs, i, end, driven_m[end] - driven_m[i]);
  }
  return sums.result();
}

RelativeError relative_error_over_frames(const PosePairs& pairs, int frames) {
  const std::vector<double> driven_m = tools::distances(pairs.truth);
  SegmentSums sums;
  sums.mean.frames = frames;
  const std::size_t step = static_cast<std::size_t>(frames);
  for (std::size_t i = 0; i + step < pairs.size(); ++i) {
    sums.add(pairs, i, i + step, driven_m[i + step] - driven_m[i]);
  }
  return sums.result();
}

std::vector<double> lengths_that_fit(double driven_m) {
  std::vector<double> lengths;
  const std::vector<double> kitti = {100, 200, 300, 400, 500, 600, 700, 800};
  const std::vector<double> shorter = {5, 10, 20, 50};
  for (const double length_m : driven_m >= kitti.front() ? kitti : shorter) {
    if (length_m <= driven_m) lengths.push_back(length_m);
  }
  return lengths;
}

double drift_percent(const PosePairs& pairs) {
  if (pairs.size() < 2) return 0.0;
  const double driven_m = tools::distances(pairs.truth).back();
  if (driven_m <= 0.0) return 0.0;
  return 100.0 * motion_error(pairs, 0, pairs.size() - 1).p.norm() / driven_m;
}

Vec6 pose_error(const Pose& estimate, const Pose& truth) {
  return log_se3(estimate.inverse() * truth);
}

std::optional<double> nees(const Vec6& xi, const Mat6& P) {
  const Eigen::LLT<Mat6> llt(P);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return xi.dot(llt.solve(xi));
}

}  // namespace rcs::evaluation
