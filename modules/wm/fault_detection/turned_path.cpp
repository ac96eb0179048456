#include "modules/wm/fault_detection/turned_path.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rcs::wm {

void TurnedPath::add(Stamp stamp, const Vec3& own_m, const Vec3& own_mps, double own_radps,
                     const Vec3& fix_m, double sigma_m) {
  const bool interrupted = n_ > 0 && (stamp < last_ || stamp - last_ > kSilence);
  if (interrupted || way_m_ > kLongest_m) *this = {};
  last_ = stamp;
  const Vec2 own = own_m.head<2>();
  const Vec2 fix = fix_m.head<2>();
  const double step_m = (own - last_own_).norm();
  if (n_ > 0 && step_m < kSpacing_m) return;
  if (n_ == 0) {
    first_ = stamp;
    own0_ = own;
    fix0_ = fix;
  } else {
    way_m_ += step_m;
  }
  last_own_ = own;
  ++n_;
  const Vec2 a = own - own0_;
  const Vec2 b = fix - fix0_;
  const double t = seconds(stamp - first_);
  sigma_m_ = std::max(sigma_m_, sigma_m);
  own_ += a;
  fix_ += b;
  own2_ += a.squaredNorm();
  fix2_ += b.squaredNorm();
  dot_ += a.dot(b);
  cross_ += a.x() * b.y() - a.y() * b.x();
  const Vec2 v = own_mps.head<2>();
  const Vec2 accel = own_radps * Vec2(-v.y(), v.x());
  Mat<2, 6> J;
  J << 1.0, 0.0, t, 0.0, v.x(), accel.x(), 0.0, 1.0, 0.0, t, v.y(), accel.y();
  H_ += J.transpose() * J;
  g_ += J.transpose() * (b - a);
  off2_ += (b - a).squaredNorm();
}

std::optional<TurnedPath::Turn> TurnedPath::found() const {
  constexpr int kFewest = 10;
  if (n_ < kFewest || way_m_ < kShortest_m) return std::nullopt;
  const double n = n_;
  const Vec2 mean_own = own_ / n;
  const Vec2 mean_fix = fix_ / n;
  const double spread2 = own2_ - n * mean_own.squaredNorm();
  const double dot = dot_ - n * mean_own.dot(mean_fix);
  const double cross = cross_ - n * (mean_own.x() * mean_fix.y() - mean_own.y() * mean_fix.x());
  const double of_fixes2 = fix2_ - n * mean_fix.squaredNorm();
  const double turned2 = std::max(0.0, spread2 + of_fixes2 - 2.0 * std::hypot(dot, cross));
  Mat6 H = H_;
  H.diagonal().array() += 1e-6;
  const double faulty2 = std::max(0.0, off2_ - g_.dot(H.ldlt().solve(g_)));

  const double turned_m = std::sqrt(turned2 / n);
  const double faulty_m = std::sqrt(faulty2 / n);
  const double allowed_m = std::hypot(sigma_m_, kDrift * way_m_);
  if (turned_m > allowed_m || faulty_m < kClearly * std::max(turned_m, sigma_m_)) {
    return std::nullopt;
  }
  Turn out;
  const Quat q(Eigen::AngleAxisd(std::atan2(cross, dot), Vec3::UnitZ()));
  const Vec2 own = own0_ + mean_own;
  const Vec2 fix = fix0_ + mean_fix;
  const Vec3 from(own.x(), own.y(), 0.0);
  out.T_new_old = {q, Vec3(fix.x(), fix.y(), 0.0) - q * from};
  out.sigma_m = std::hypot(allowed_m, sigma_m_);
  out.sigma_yaw_rad = out.sigma_m * std::sqrt(2.0 / spread2);
  return out;
}

}  // namespace rcs::wm
