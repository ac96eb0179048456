#include "modules/wm/fault_detection/turned_path.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rcs::wm {
namespace {

constexpr int kFewest = 10;
// Of a difference of velocities, besides the noise of the fix: the velocity of the filter, too, is
// wrong.
constexpr double kFloor_mps = 0.05;
constexpr double kFloorShare = 0.01;  // of the speed
constexpr double kFits = 2.0;         // mean square of what the turn leaves, over the variance

}  // namespace

void TurnedPath::add(Stamp stamp, const Own& own, const Fix& fix) {
  const bool interrupted = n_ > 0 && (stamp < last_ || stamp - last_ > kSilence);
  if (interrupted || way_m_ > kLongest_m) *this = {};
  last_ = stamp;
  const Vec2 own_m = own.p_m.head<2>();
  const Vec2 fix_m = fix.p_m.head<2>();
  const double step_m = (own_m - last_own_).norm();
  if (n_ > 0 && step_m < kSpacing_m) return;
  if (n_ == 0) {
    first_ = stamp;
    own0_ = own_m;
    fix0_ = fix_m;
  } else {
    way_m_ += step_m;
  }
  last_own_ = own_m;
  ++n_;
  const Vec2 a = own_m - own0_;
  const Vec2 b = fix_m - fix0_;
  const double t = seconds(stamp - first_);
  sigma_m_ = std::max(sigma_m_, fix.sigma_m);
  own_ += a;
  fix_ += b;
  own2_ += a.squaredNorm();
  fix2_ += b.squaredNorm();
  dot_ += a.dot(b);
  cross_ += a.x() * b.y() - a.y() * b.x();
  const Vec2 v = own.v_mps.head<2>();
  const Vec2 accel = own.yaw_rate_radps * Vec2(-v.y(), v.x());
  Mat<2, 6> J;
  J << 1.0, 0.0, t, 0.0, v.x(), accel.x(), 0.0, 1.0, 0.0, t, v.y(), accel.y();
  H_ += J.transpose() * J;
  g_ += J.transpose() * (b - a);
  off2_ += (b - a).squaredNorm();

  if (!fix.v_mps) return;
  const Vec2 off = fix.v_mps->head<2>() - v;
  const double variance = fix.sigma_mps * fix.sigma_mps + kFloor_mps * kFloor_mps +
                          kFloorShare * kFloorShare * v.squaredNorm();
  const Mat<2, 3> J_v = (Mat<2, 3>() << 1.0, 0.0, accel.x(), 0.0, 1.0, accel.y()).finished();
  H_v_ += J_v.transpose() * J_v / variance;
  g_v_ += J_v.transpose() * off / variance;
  off_v2_ += off.squaredNorm() / variance;
  speed2_ += v.squaredNorm() / variance;
  across_ += (v.x() * off.y() - v.y() * off.x()) / variance;
  ++velocities_;
}

double TurnedPath::allowed_m() const { return std::hypot(sigma_m_, kDrift * way_m_); }

double TurnedPath::residual_m(double yaw_rad) const {
  const double n = n_;
  const Vec2 own = own_ / n;
  const Vec2 fix = fix_ / n;
  const double dot = dot_ - n * own.dot(fix);
  const double cross = cross_ - n * (own.x() * fix.y() - own.y() * fix.x());
  const double spread2 = own2_ - n * own.squaredNorm() + fix2_ - n * fix.squaredNorm();
  const double turned2 = spread2 - 2.0 * (std::cos(yaw_rad) * dot + std::sin(yaw_rad) * cross);
  return std::sqrt(std::max(0.0, turned2) / n);
}

std::optional<double> TurnedPath::by_positions() const {
  const double n = n_;
  const double dot = dot_ - own_.dot(fix_) / n;
  const double cross = cross_ - (own_.x() * fix_.y() - own_.y() * fix_.x()) / n;
  const double yaw_rad = std::atan2(cross, dot);
  Mat6 H = H_;
  H.diagonal().array() += 1e-6;
  const double faulty2 = std::max(0.0, off2_ - g_.dot(H.ldlt().solve(g_)));
  const double turned_m = residual_m(yaw_rad);
  const bool clear = std::sqrt(faulty2 / n) >= kClearly * std::max(turned_m, sigma_m_);
  return clear && turned_m <= allowed_m() ? std::optional(yaw_rad) : std::nullopt;
}

/// Velocities have no error that lasts for minutes, as the positions of fixes have: they tell
/// smaller angles.
std::optional<double> TurnedPath::by_velocities() const {
  if (velocities_ < kFewest || speed2_ <= 0.0) return std::nullopt;
  const double yaw_rad = across_ / speed2_;
  const double turned2 = off_v2_ - across_ * yaw_rad;
  const double faulty2 = off_v2_ - g_v_.dot((H_v_ + 1e-6 * Mat3::Identity()).ldlt().solve(g_v_));
  const bool fits = turned2 <= kFits * 2.0 * velocities_;
  const bool likelier = 0.5 * (faulty2 - turned2) >= kLikelier;
  return fits && likelier && residual_m(yaw_rad) <= allowed_m() ? std::optional(yaw_rad)
                                                                : std::nullopt;
}

std::optional<TurnedPath::Turn> TurnedPath::found() const {
  if (n_ < kFewest || way_m_ < kShortest_m) return std::nullopt;
  std::optional<double> yaw_rad = by_positions();
  if (!yaw_rad) yaw_rad = by_velocities();
  if (!yaw_rad) return std::nullopt;
  const double n = n_;
  const Vec2 own = own0_ + own_ / n;
  const Vec2 fix = fix0_ + fix_ / n;
  const double spread2 = own2_ - own_.squaredNorm() / n;
  Turn out;
  const Quat q(Eigen::AngleAxisd(*yaw_rad, Vec3::UnitZ()));
  out.T_new_old = {q, Vec3(fix.x(), fix.y(), 0.0) - q * Vec3(own.x(), own.y(), 0.0)};
  out.sigma_m = std::hypot(allowed_m(), sigma_m_);
  out.sigma_yaw_rad = out.sigma_m * std::sqrt(2.0 / spread2);
  return out;
}

}  // namespace rcs::wm
