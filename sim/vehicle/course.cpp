#include "sim/vehicle/course.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"
#include "sim/base/random.h"

namespace rcs::sim {
namespace {

constexpr double kStep_m = 0.25;  // of the fine samples, approximately

// Index k of the interval [x[k], x[k + 1]] that contains `value`, and the share within it.
std::size_t interval(const std::vector<double>& x, double value, double* share) {
  const std::size_t above =
      static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), value) - x.begin());
  const std::size_t k = std::clamp<std::size_t>(above, 1, x.size() - 1) - 1;
  const double width = x[k + 1] - x[k];
  *share = width > 0.0 ? std::clamp((value - x[k]) / width, 0.0, 1.0) : 0.0;
  return k;
}

double lerp(double a, double b, double share) { return a + share * (b - a); }

}  // namespace

std::vector<Vec2> random_waypoints(const RandomCourseParams& params, std::uint64_t seed) {
  Random random(seed, Stream::kCourse);
  std::vector<Vec2> waypoints = {Vec2::Zero()};
  double heading_rad = 2.0 * kPi * random.uniform();
  for (int k = 0; k < params.count; ++k) {
    const double turn = 2.0 * random.uniform() - 1.0;
    if (k > 0) heading_rad += params.turn_rad * turn;
    const double leg_m = lerp(params.leg_min_m, params.leg_max_m, random.uniform());
    waypoints.push_back(waypoints.back() +
                        leg_m * Vec2(std::cos(heading_rad), std::sin(heading_rad)));
  }
  return waypoints;
}

Course::Course(const CourseParams& params) {
  RCS_CHECK(params.waypoints_world.size() >= 2 && params.speed_mps > 0.0);
  fit(params.waypoints_world);
  schedule(params);
}

void Course::fit(const std::vector<Vec2>& waypoints) {
  value_ = waypoints;
  knot_.push_back(0.0);
  for (std::size_t k = 1; k < value_.size(); ++k) {
    knot_.push_back(knot_.back() + (value_[k] - value_[k - 1]).norm());
    RCS_CHECK(knot_[k] > knot_[k - 1]);
  }
  // Natural spline: the tridiagonal system for the second derivatives, by elimination.
  const std::size_t n = value_.size();
  second_.assign(n, Vec2::Zero());
  std::vector<double> upper(n, 0.0);
  std::vector<Vec2> right(n, Vec2::Zero());
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double h0 = knot_[k] - knot_[k - 1];
    const double h1 = knot_[k + 1] - knot_[k];
    const Vec2 bend = 6.0 * ((value_[k + 1] - value_[k]) / h1 - (value_[k] - value_[k - 1]) / h0);
    const double diagonal = 2.0 * (h0 + h1) - h0 * upper[k - 1];
    upper[k] = h1 / diagonal;
    right[k] = (bend - h0 * right[k - 1]) / diagonal;
  }
  for (std::size_t k = n - 2; k > 0; --k) second_[k] = right[k] - upper[k] * second_[k + 1];
}

void Course::evaluate(double u, Vec2* p, Vec2* dp, Vec2* ddp) const {
  double b = 0.0;
  const std::size_t k = interval(knot_, u, &b);
  const double a = 1.0 - b;
  const double h = knot_[k + 1] - knot_[k];
  *p = a * value_[k] + b * value_[k + 1] +
       (h * h / 6.0) * ((a * a * a - a) * second_[k] + (b * b * b - b) * second_[k + 1]);
  *dp = (value_[k + 1] - value_[k]) / h +
        (h / 6.0) * ((3.0 * b * b - 1.0) * second_[k + 1] - (3.0 * a * a - 1.0) * second_[k]);
  *ddp = a * second_[k] + b * second_[k + 1];
}

double Course::curvature(double u) const {
  Vec2 p, dp, ddp;
  evaluate(u, &p, &dp, &ddp);
  return std::abs(dp.x() * ddp.y() - dp.y() * ddp.x()) / std::pow(dp.squaredNorm(), 1.5);
}

void Course::schedule(const CourseParams& params) {
  const std::size_t n = static_cast<std::size_t>(std::ceil(knot_.back() / kStep_m)) + 1;
  Vec2 last = value_.front();
  for (std::size_t k = 0; k < n; ++k) {
    const double u = knot_.back() * static_cast<double>(k) / static_cast<double>(n - 1);
    Vec2 p, dp, ddp;
    evaluate(u, &p, &dp, &ddp);
    parameter_.push_back(u);
    arc_m_.push_back(k == 0 ? 0.0 : arc_m_.back() + (p - last).norm());
    last = p;
    const double bend = curvature(u);
    speed_mps_.push_back(
        std::min(params.speed_mps, std::sqrt(params.lateral_mps2 / std::max(bend, 1e-6))));
  }
  // From rest to rest, with bounded acceleration: one pass in each direction.
  speed_mps_.front() = 0.0;
  speed_mps_.back() = 0.0;
  const auto reachable = [&](double speed, double way_m) {
    return std::sqrt(speed * speed + 2.0 * params.acceleration_mps2 * way_m);
  };
  for (std::size_t k = 1; k < n; ++k) {
    speed_mps_[k] =
        std::min(speed_mps_[k], reachable(speed_mps_[k - 1], arc_m_[k] - arc_m_[k - 1]));
  }
  for (std::size_t k = n - 1; k > 0; --k) {
    speed_mps_[k - 1] =
        std::min(speed_mps_[k - 1], reachable(speed_mps_[k], arc_m_[k] - arc_m_[k - 1]));
  }
  moment_s_.push_back(params.rest_s);
  for (std::size_t k = 1; k < n; ++k) {
    moment_s_.push_back(moment_s_.back() +
                        2.0 * (arc_m_[k] - arc_m_[k - 1]) / (speed_mps_[k] + speed_mps_[k - 1]));
  }
}

double Course::distance_at(double time_s) const {
  if (time_s <= moment_s_.front()) return 0.0;
  if (time_s >= moment_s_.back()) return length_m();
  double share = 0.0;
  const std::size_t k = interval(moment_s_, time_s, &share);
  // Constant acceleration between the samples.
  const double dt = time_s - moment_s_[k];
  const double acceleration =
      (speed_mps_[k + 1] - speed_mps_[k]) / (moment_s_[k + 1] - moment_s_[k]);
  return arc_m_[k] + speed_mps_[k] * dt + 0.5 * acceleration * dt * dt;
}

CoursePoint Course::at_distance(double arc_m) const {
  double share = 0.0;
  const std::size_t k = interval(arc_m_, arc_m, &share);
  Vec2 p, dp, ddp;
  evaluate(lerp(parameter_[k], parameter_[k + 1], share), &p, &dp, &ddp);
  return {p, std::atan2(dp.y(), dp.x())};
}

std::vector<Vec2> Course::points() const {
  std::vector<Vec2> points;
  for (double s = 0.0; s < length_m(); s += 0.5) points.push_back(at_distance(s).p_world);
  points.push_back(at_distance(length_m()).p_world);
  return points;
}

}  // namespace rcs::sim
