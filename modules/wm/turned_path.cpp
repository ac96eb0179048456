#include "modules/wm/turned_path.h"

#include <algorithm>
#include <cmath>

namespace rcs::wm {

void TurnedPath::add(Stamp stamp, const Vec3& own_m, const Vec3& fix_m, double sigma_m) {
  if (n_ > 0 && (stamp < last_ || stamp - last_ > kSilence)) *this = {};
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
  t_ += t;
  t2_ += t * t;
  off_t_ += (b - a) * t;
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
  // Fixes that drift: fix - own = d + v t.
  const double off2 = own2_ + fix2_ - 2.0 * dot_ - n * (mean_fix - mean_own).squaredNorm();
  const double tt = t2_ - t_ * t_ / n;
  const Vec2 slope_t = off_t_ - (mean_fix - mean_own) * t_;
  const double drifting2 = std::max(0.0, off2 - slope_t.squaredNorm() / std::max(tt, 1e-9));

  const double turned_m = std::sqrt(turned2 / n);
  const double drifting_m = std::sqrt(drifting2 / n);
  const double allowed_m = std::hypot(sigma_m_, kDrift * way_m_);
  if (turned_m > allowed_m || drifting_m < kClearly * std::max(turned_m, sigma_m_)) {
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
