#include "sim/vehicle/trajectory.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"

namespace rcs::sim {
namespace {

// Cumulative basis of the uniform cubic B-spline and its derivatives by u.
struct Basis {
  double b[3], db[3], ddb[3];
};

Basis basis(double u) {
  const double u2 = u * u;
  const double u3 = u2 * u;
  return {{(5.0 + 3.0 * u - 3.0 * u2 + u3) / 6.0, (1.0 + 3.0 * u + 3.0 * u2 - 2.0 * u3) / 6.0,
           u3 / 6.0},
          {(1.0 - 2.0 * u + u2) / 2.0, (1.0 + 2.0 * u - 2.0 * u2) / 2.0, u2 / 2.0},
          {u - 1.0, 1.0 - 2.0 * u, u}};
}

}  // namespace

Trajectory::Trajectory(std::vector<Pose> knots, double interval_s)
    : knots_(std::move(knots)), interval_s_(interval_s) {
  RCS_CHECK(knots_.size() >= 4 && interval_s > 0.0);
  duration_s_ = static_cast<double>(knots_.size() - 3) * interval_s;
  for (std::size_t k = 0; k + 1 < knots_.size(); ++k) {
    turns_.push_back(log_so3(knots_[k].q.conjugate() * knots_[k + 1].q));
  }
}

void Trajectory::append(const Pose& knot) {
  turns_.push_back(log_so3(knots_.back().q.conjugate() * knot.q));
  knots_.push_back(knot);
  duration_s_ = static_cast<double>(forgotten_ + knots_.size() - 3) * interval_s_;
}

void Trajectory::forget_before(double time_s) {
  const std::size_t needed = static_cast<std::size_t>(std::max(0.0, time_s) / interval_s_);
  if (needed <= forgotten_) return;
  const std::size_t old = std::min(needed - forgotten_, knots_.size() - 4);
  // Erases many at once, because the remaining ones are moved.
  if (2 * old < knots_.size()) return;
  knots_.erase(knots_.begin(), knots_.begin() + static_cast<std::ptrdiff_t>(old));
  turns_.erase(turns_.begin(), turns_.begin() + static_cast<std::ptrdiff_t>(old));
  forgotten_ += old;
}

Trajectory::Segment Trajectory::segment(double time_s) const {
  const double at = std::clamp(time_s, 0.0, duration_s_) / interval_s_;
  const std::size_t first = std::min(static_cast<std::size_t>(at), forgotten_ + knots_.size() - 4);
  RCS_CHECK(first >= forgotten_);
  return {first - forgotten_, at - static_cast<double>(first)};
}

// Sommer, Usenko, Schubert, Demmel & Cremers 2020: the angular rate of a cumulative spline is
// obtained by rotating the rate of each factor through the following ones.
Motion Trajectory::at(double time_s) const {
  const Segment s = segment(time_s);
  const Basis w = basis(s.u);
  Motion m;
  m.T_world_vehicle = knots_[s.first];
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec3 step = knots_[s.first + j + 1].p - knots_[s.first + j].p;
    m.T_world_vehicle.p += w.b[j] * step;
    m.v_world += w.db[j] / interval_s_ * step;
    m.a_world += w.ddb[j] / (interval_s_ * interval_s_) * step;
    const Vec3& turn = turns_[s.first + j];
    const Quat q = exp_so3(w.b[j] * turn);
    m.rate_vehicle = q.conjugate() * m.rate_vehicle + w.db[j] / interval_s_ * turn;
    m.T_world_vehicle.q = m.T_world_vehicle.q * q;
  }
  m.T_world_vehicle.q.normalize();
  return m;
}

Pose Trajectory::pose_at(double time_s) const {
  const Segment s = segment(time_s);
  const Basis w = basis(s.u);
  Pose T = knots_[s.first];
  for (std::size_t j = 0; j < 3; ++j) {
    T.p += w.b[j] * (knots_[s.first + j + 1].p - knots_[s.first + j].p);
    T.q = T.q * exp_so3(w.b[j] * turns_[s.first + j]);
  }
  T.q.normalize();
  return T;
}

}  // namespace rcs::sim
