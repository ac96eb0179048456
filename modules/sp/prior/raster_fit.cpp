#include "modules/sp/prior/raster_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "modules/sp/prior/geman_mcclure.h"
#include "modules/sp/prior/prior_match.h"

namespace rcs::sp {
namespace {

// Decay of the inflation in each step, below kSpreadEnds_m to zero.
constexpr double kSpreadSinks = 0.7;
constexpr double kSpreadEnds_m = 0.02;
// A step that is not smaller than the one before by this factor is halved, and all that follow.
// Steps that shrink slowly are not halved: where the map has few of the slopes of the scan, all
// steps are short.
constexpr double kShrinks = 0.98;
constexpr double kMinDamping = 0.1;
constexpr double kNewtonLonger = 5.0;  // longest Newton step, in other steps

constexpr int kUnknowns = 7;
using Mat7 = Mat<kUnknowns, kUnknowns>;
using Vec7 = Vec<kUnknowns>;

Vec2 turned(double c, double s, const Vec2& v) {
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

/// Of the height of a point above the map's ground (see distance_jacobian() for the vegetation).
Vec7 jacobian(const Vec2& slope, const Vec2& arm) {
  const double away = std::max(1e-9, arm.norm());
  Vec7 J;
  J << -slope, 1.0, -slope.dot(Vec2(-arm.y(), arm.x())), arm, -slope.dot(arm) / away;
  return J;
}

/// A cell of the scan for a candidate pose.
struct Residual {
  double r_m = 0.0;
  double sigma_m = 0.0;
  Vec2 arm, map_slope, scan_slope;  ///< axes of the map
};
bool look(const RasterFit& s, const ScanGroundCell& cell, const RasterPose& pose, double cos_yaw,
          double sin_yaw, Residual* out) {
  out->arm = turned(cos_yaw, sin_yaw, cell.p.head<2>());
  Elevation e;
  if (!s.map.sample(pose.p_map.x() + out->arm.x(), pose.p_map.y() + out->arm.y(), &e, s.level)) {
    return false;
  }
  out->r_m = pose.p_map.z() + cell.p.z() + pose.tilt.dot(out->arm) - e.z_m;
  out->sigma_m = std::max(e.sigma_m, s.params.min_sigma_m);
  out->map_slope = e.gradient;
  out->scan_slope = turned(cos_yaw, sin_yaw, cell.slope) + pose.tilt;
  return true;
}

Mat7 priors(const RasterFit& s) {
  constexpr double kHold = 1e-4;  // 1 / (100 m)^2
  const double tilt = 1.0 / (s.tilt_sigma_rad * s.tilt_sigma_rad);
  Vec7 d;
  d << kHold, kHold, kHold, kHold, tilt, tilt, 1.0 / (s.params.foliage_m * s.params.foliage_m);
  return d.asDiagonal();
}

/// One step to the root of the sums of residuals times slopes of the scan. Gauss-Newton steps with
/// the slopes of the scan alone always approach it, but slowly where map and scan have few slopes
/// in common; Newton steps need the slopes of the map, too, whose errors may turn them around.
/// @param newton  take the Newton step if it agrees with the other one
/// @return displacement [m] of a point 10 m away
double refine(const RasterFit& s, const std::vector<ScanGroundCell>& cells, double spread_m,
              double damping, bool newton, RasterPose* pose) {
  constexpr double kArm_m = 10.0;
  const double c = std::cos(pose->yaw_rad), sn = std::sin(pose->yaw_rad);
  Mat7 H = priors(s), A = priors(s);
  Vec7 g = Vec7::Zero();
  g.segment<2>(4) = pose->tilt / (s.tilt_sigma_rad * s.tilt_sigma_rad);
  for (const ScanGroundCell& cell : cells) {
    Residual r;
    if (!look(s, cell, *pose, c, sn, &r)) continue;
    const double sigma = std::hypot(r.sigma_m, spread_m);
    if (std::abs(r.r_m) > s.params.gate_sigma * sigma) continue;
    const double w =
        robust_weight(r.r_m / sigma, s.params.robust_sigma) / (sigma * sigma * s.share);
    const Vec7 J = jacobian(r.scan_slope, r.arm);
    H.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
    g += (w * r.r_m) * J;
    if (newton) A += (w * J) * jacobian(r.map_slope, r.arm).transpose();
  }
  Vec7 step = -damping * H.selfadjointView<Eigen::Lower>().ldlt().solve(g);
  if (newton) {
    const Vec7 other = -damping * A.partialPivLu().solve(g);
    const auto size = [&H](const Vec7& v) {
      return std::sqrt(v.dot(H.selfadjointView<Eigen::Lower>() * v));
    };
    const double along = step.dot(H.selfadjointView<Eigen::Lower>() * other);
    if (along > 0.0 && size(other) < kNewtonLonger * size(step)) step = other;
  }
  pose->p_map += step.head<3>();
  pose->yaw_rad = wrap_angle(pose->yaw_rad + step[3]);
  pose->tilt += step.segment<2>(4);
  return std::hypot(step.head<2>().norm(), kArm_m * step[3]) / damping;
}

/// Blocks around the vehicle, [0, kBlocks^2).
constexpr int kBlocks = 24;
std::size_t block_of(const RasterFit& s, const Vec3& p) {
  const auto index = [&](double v) {
    return std::clamp(static_cast<int>(std::floor(v / s.block_m)) + kBlocks / 2, 0, kBlocks - 1);
  };
  return static_cast<std::size_t>(index(p.y()) * kBlocks + index(p.x()));
}

}  // namespace

void evaluate(const RasterFit& s, const std::vector<ScanGroundCell>& cells, double spread_m,
              std::vector<double>* residuals, RasterPose* pose) {
  const double c = std::cos(pose->yaw_rad), sn = std::sin(pose->yaw_rad);
  pose->p_map.z() = 0.0;
  pose->tilt.setZero();
  pose->cost = std::numeric_limits<double>::infinity();
  residuals->clear();
  double variance = 0.0;
  for (const ScanGroundCell& cell : cells) {
    Residual r;
    const bool known = look(s, cell, *pose, c, sn, &r);
    residuals->push_back(known ? r.r_m : std::numeric_limits<double>::quiet_NaN());
    if (known && variance == 0.0) variance = r.sigma_m * r.sigma_m + spread_m * spread_m;
  }
  // The plane starts at the median of cells all over the scan; the median of all needs a copy.
  double middle[63];
  std::size_t n = 0;
  const std::size_t stride = (residuals->size() + std::size(middle) - 1) / std::size(middle);
  for (std::size_t k = 0; k < residuals->size(); k += stride) {
    if (!std::isnan((*residuals)[k])) middle[n++] = (*residuals)[k];
  }
  if (n < std::size(middle) / 3) return;
  std::nth_element(middle, middle + n / 2, middle + n);
  const double sigma = std::sqrt(variance);
  Vec3 plane(middle[n / 2], 0.0, 0.0);
  for (int round = 0; round < 2; ++round) {
    Mat3 A = Vec3(1e-9, 0.0, 0.0).asDiagonal();
    A.diagonal().tail<2>().array() += variance / (s.tilt_sigma_rad * s.tilt_sigma_rad);
    Vec3 b = Vec3::Zero();
    for (std::size_t k = 0; k < cells.size(); ++k) {
      if (std::isnan((*residuals)[k])) continue;
      const Vec2 arm = turned(c, sn, cells[k].p.head<2>());
      const Vec3 t(1.0, arm.x(), arm.y());
      const double w =
          robust_weight(((*residuals)[k] - plane.dot(t)) / (2.0 * sigma), s.params.robust_sigma);
      A += w * t * t.transpose();
      b += w * (*residuals)[k] * t;
    }
    plane = A.ldlt().solve(b);
  }
  double cost = 0.0;
  std::size_t known = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (std::isnan((*residuals)[k])) continue;
    const Vec2 arm = turned(c, sn, cells[k].p.head<2>());
    cost += robust_cost(((*residuals)[k] - plane.dot(Vec3(1.0, arm.x(), arm.y()))) / sigma,
                        s.params.robust_sigma);
    ++known;
  }
  if (2 * known < cells.size()) return;
  pose->p_map.z() = -plane[0];
  pose->tilt = -plane.tail<2>();
  pose->cost = cost / static_cast<double>(known);
}

RasterSteps converge(const RasterFit& s, const std::vector<ScanGroundCell>& cells, double spread_m,
                     int max_steps, double smallest_m, RasterPose* pose) {
  double damping = 1.0, last_m = std::numeric_limits<double>::infinity();
  RasterSteps steps;
  while (steps.taken < max_steps) {
    const bool final = spread_m == 0.0;
    const double step_m = refine(s, cells, spread_m, damping, final, pose);
    ++steps.taken;
    steps.converged = final && step_m < smallest_m;
    if (steps.converged) break;
    if (final && step_m > kShrinks * last_m) damping = std::max(kMinDamping, 0.5 * damping);
    if (final) last_m = step_m;
    spread_m = spread_m < kSpreadEnds_m ? 0.0 : kSpreadSinks * spread_m;
  }
  return steps;
}

void costs_by_block(const RasterFit& s, const std::vector<ScanGroundCell>& cells,
                    const RasterPose& pose, std::vector<double>* costs) {
  const double c = std::cos(pose.yaw_rad), sn = std::sin(pose.yaw_rad);
  costs->assign(static_cast<std::size_t>(kBlocks) * kBlocks, 0.0);
  for (const ScanGroundCell& cell : cells) {
    Residual r;
    const double robust = s.params.robust_sigma;
    (*costs)[block_of(s, cell.p)] += look(s, cell, pose, c, sn, &r)
                                         ? robust_cost(r.r_m / r.sigma_m, robust)
                                         : 0.5 * robust * robust;
  }
}

double advantage(const std::vector<double>& first, const std::vector<double>& second) {
  double sum = 0.0, square = 0.0, n = 0.0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    if (first[k] == 0.0 && second[k] == 0.0) continue;
    const double d = second[k] - first[k];
    sum += d;
    square += d * d;
    n += 1.0;
  }
  const double about_mean = square - sum * sum / std::max(1.0, n);
  return sum / std::sqrt(std::max(1e-12, about_mean * n / std::max(1.0, n - 1.0)));
}

RasterAccuracy accuracy_of(const RasterFit& s, const std::vector<ScanGroundCell>& cells,
                           const RasterPose& pose, std::vector<RasterBlock>* blocks) {
  const double c = std::cos(pose.yaw_rad), sn = std::sin(pose.yaw_rad);
  blocks->assign(static_cast<std::size_t>(kBlocks) * kBlocks, {});
  Mat7 stated = priors(s), sensitivity = priors(s);
  for (const ScanGroundCell& cell : cells) {
    Residual r;
    if (!look(s, cell, pose, c, sn, &r)) continue;
    const double w =
        robust_weight(r.r_m / r.sigma_m, s.params.robust_sigma) / (r.sigma_m * r.sigma_m * s.share);
    const Vec7 J = jacobian(r.scan_slope, r.arm);
    stated += w * J * J.transpose();
    RasterBlock& block = (*blocks)[block_of(s, cell.p)];
    block.sensitivity += w * J * jacobian(r.map_slope, r.arm).transpose();
    block.score += (w * r.r_m) * J;
  }
  int n = 0;
  for (const RasterBlock& block : *blocks) {
    sensitivity += block.sensitivity;
    if (!block.score.isZero(0.0)) ++n;
  }
  RasterAccuracy out;
  constexpr int kFewestBlocks = 2 * kUnknowns;
  if (n < kFewestBlocks) return out;
  // A block that alone determines a direction has small residuals there: the change of the result
  // without it shows its errors, the sum of its residuals does not (Tukey, 1958).
  Mat7 scatter = Mat7::Zero();
  for (const RasterBlock& block : *blocks) {
    if (block.score.isZero(0.0)) continue;
    const Mat7 without = sensitivity - block.sensitivity;
    const Vec7 change = sensitivity * without.partialPivLu().solve(block.score);
    scatter += change * change.transpose();
  }
  scatter *= (n - 1.0) / n;
  // In coordinates in which `stated` is the identity.
  const Eigen::LLT<Mat7> root(stated);
  const Mat7 L = root.matrixL();
  const Mat7 whiten = L.inverse();
  const Eigen::SelfAdjointEigenSolver<Mat7> axes(Mat7(whiten * scatter * whiten.transpose()));
  const Mat7 at_least = axes.eigenvectors() * axes.eigenvalues().cwiseMax(1.0).asDiagonal() *
                        axes.eigenvectors().transpose();
  const Mat7 inverse = (whiten * sensitivity * whiten.transpose()).inverse();
  out.covariance = whiten.transpose() * inverse * at_least * inverse.transpose() * whiten;
  out.valid = scatter.allFinite() && out.covariance.allFinite();
  if (!out.valid) return out;
  const Eigen::SelfAdjointEigenSolver<Mat<2, 2>> plane(
      Mat<2, 2>(out.covariance.topLeftCorner<2, 2>()));
  const Vec7 weakest = out.covariance.leftCols<2>() * plane.eigenvectors().col(1);
  // Regression of the map's slopes on the scan's along this direction, with errors by block.
  double product = 0.0, square = 0.0;
  const auto along = [&](const auto& use) {
    for (const ScanGroundCell& cell : cells) {
      Residual r;
      if (!look(s, cell, pose, c, sn, &r)) continue;
      const double w =
          robust_weight(r.r_m / r.sigma_m, s.params.robust_sigma) / (r.sigma_m * r.sigma_m);
      use(cell, w, jacobian(r.scan_slope, r.arm).dot(weakest),
          jacobian(r.map_slope, r.arm).dot(weakest));
    }
  };
  along([&](const ScanGroundCell&, double w, double of_scan, double of_map) {
    product += w * of_scan * of_map;
    square += w * of_scan * of_scan;
  });
  const double share = product / std::max(1e-300, square);
  along([&](const ScanGroundCell& cell, double w, double of_scan, double of_map) {
    (*blocks)[block_of(s, cell.p)].product += w * of_scan * (of_map - share * of_scan);
  });
  double scatter_of_product = 0.0;
  for (const RasterBlock& block : *blocks) scatter_of_product += block.product * block.product;
  out.slopes = product / std::sqrt(std::max(1e-300, scatter_of_product));
  return out;
}

RasterResiduals residuals_of(const RasterFit& s, const std::vector<ScanGroundCell>& cells,
                             const RasterPose& pose) {
  const double c = std::cos(pose.yaw_rad), sn = std::sin(pose.yaw_rad);
  RasterResiduals out;
  double sum = 0.0, square = 0.0;
  for (const ScanGroundCell& cell : cells) {
    Residual r;
    if (!look(s, cell, pose, c, sn, &r)) continue;
    if (std::abs(r.r_m) > s.params.gate_sigma * r.sigma_m) continue;
    sum += std::abs(r.r_m);
    square += r.r_m * r.r_m;
    ++out.matched;
  }
  if (out.matched == 0) return out;
  out.mean_m = sum / out.matched;
  out.rms_m = std::sqrt(square / out.matched);
  return out;
}

}  // namespace rcs::sp
