#include "modules/wm/alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::wm {
namespace {

void set_variance(int index, int size, double sigma, Cov* P) {
  P->diagonal().segment(index, size).setConstant(sigma * sigma);
}

/// The attitude with heading 0 in which the specific force points up.
Quat level_attitude(const Vec3& specific_force) {
  const Vec3 up = specific_force.normalized();
  const double roll = std::atan2(up.y(), up.z());
  const double pitch = std::asin(std::clamp(-up.x(), -1.0, 1.0));
  return Quat(Eigen::AngleAxisd(pitch, Vec3::UnitY()) * Eigen::AngleAxisd(roll, Vec3::UnitX()));
}

/// The specific force at rest is the sum of gravity and a bias; each is assigned its share. If all
/// of it were gravity, the bias would cause a climb once the datum defines gravity.
double gravity_in(double specific_force, const ProcessNoise& ins) {
  constexpr double kSpread = 0.015;  // of normal gravity over the latitudes [m/s^2]
  const double standard = Earth{}.gravity;
  const double share =
      kSpread * kSpread / (kSpread * kSpread + ins.accel_turn_on * ins.accel_turn_on);
  return standard + share * (specific_force - standard);
}

constexpr double kFusedNext = 3.0;  // factor on the sigma of a fix that is fused next
constexpr double kSideSlip = 0.1;   // of a car, over its speed
constexpr double kSameSpeed = 0.3;  // share by which two speeds of one vehicle may differ

/// From LADAR, wheels, or a start at rest: the path of the filter then has the shape of the drive.
bool knows_velocity(const FilterState& s) {
  constexpr double kKnown_mps = 1.0;
  return s.belief.P.diagonal().segment<2>(kVelocity).maxCoeff() < kKnown_mps * kKnown_mps;
}

double square(double v) { return v * v; }

/// A rotation about the vertical and a shift that map p_old to p_new.
Pose turn_and_shift(double yaw_rad, const Vec3& p_old, const Vec3& p_new) {
  const Quat q(Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ()));
  return {q, p_new - q * p_old};
}

}  // namespace

Belief initial_belief(const WmParams& params, Stamp stamp) {
  Belief b;
  b.x.stamp = stamp;
  // Position and heading define the frame and are exact; the other states are not.
  set_variance(kPosition, 3, 1e-3, &b.P);
  set_variance(kVelocity, 3, params.align.speed_sigma_mps, &b.P);
  set_variance(kAttitude, 2, params.align.tilt_sigma_rad, &b.P);
  set_variance(kAttitude + 2, 1, 1e-4, &b.P);
  set_variance(kGyroBias, 3, params.ins.gyro_turn_on, &b.P);
  set_variance(kAccelBias, 3, params.ins.accel_turn_on, &b.P);
  // Gravity is always present: its cross-axis effect by misalignment acts as a bias.
  const double tilted = params.ins.mount_sigma_rad * Earth{}.gravity;
  b.P.diagonal().segment<2>(kAccelBias).array() += tilted * tilted;
  // Misalignment of the accelerometers and of the gyros, whose axes define the vehicle axes.
  const double crooked = std::sqrt(2.0) * params.ins.scale_and_misalignment;
  set_variance(kCrossAxisX, 3, crooked, &b.P);
  set_variance(kCrossAxisY, 3, crooked, &b.P);
  set_variance(kMapBias, 3, params.drive.map_sigma_m, &b.P);
  set_variance(kWheelScale, 1, params.odometry.scale_sigma, &b.P);
  set_variance(kGpsBias, 3, 1.0, &b.P);
  set_variance(kRate, 3, params.motion.rate_sigma, &b.P);
  set_variance(kSlip, 3, 1.0, &b.P);
  set_variance(kClimbSlip, 1, params.odometry.climb_slip, &b.P);
  set_variance(kMount, 3, params.mount.sigma_rad, &b.P);
  return b;
}

void begin_again(const WmParams& params, FilterState* s) {
  constexpr double kNoGate = std::numeric_limits<double>::infinity();
  const NavState& old = s->belief.x;
  Bookkeeping& m = s->bookkeeping;
  Belief b = initial_belief(params, old.stamp);
  if (uses_forces(*s)) {
    const Vec3& force = m.stillness.mean_force;
    b.x.inertial = true;
    b.x.T_world_vehicle.q = level_attitude(force);
    const double sigma = params.align.moving_level_sigma_mps2;
    b = update(b, level(b.x, force, Earth{}.gravity, sigma), kNoGate).belief;
    b.x.rate_vehicle = old.rate_vehicle;
    set_variance(kRate, 3, 0.0, &b.P);
  }
  s->belief = b;
  m.sources = {};
  m.divergences = {};
  m.gps_scale = {};
  m.heights_refused = 0;
  m.georeferenced = m.gps_suspected = false;
  const Excluded before = m.excluded;
  m.excluded = {};
  m.excluded.ins = before.ins;
  m.excluded.force = before.force;
  m.fix_received = Stamp::min();
  m.uncorrected = Pose{};
}

std::optional<Belief> Leveler::add(const ImuSample& imu, const WmParams& params) {
  if (first_ == Stamp::max()) first_ = imu.stamp - imu.interval;
  stillness_.add(imu, params.stillness.window_s);
  const bool quiet = stillness_.quiet(params.stillness);
  if (quiet != still_) {
    sum_angle_.setZero();
    sum_force_.setZero();
    sum_s_ = 0.0;
    still_ = quiet;
  }
  sum_angle_ += imu.delta_angle;
  sum_force_ += imu.delta_v;
  sum_s_ += seconds(imu.interval);
  const bool at_rest = still_ && sum_s_ >= seconds(params.align.level_time);
  const bool in_motion = !still_ && imu.stamp - first_ >= params.align.patience;
  if (!at_rest && !in_motion) return std::nullopt;

  const Vec3 force = sum_force_ / sum_s_;
  gravity_ = gravity_in(force.norm(), params.ins);
  Belief b = initial_belief(params, imu.stamp);
  b.x.inertial = true;
  b.x.T_world_vehicle.q = level_attitude(force);
  constexpr double kNoGate = std::numeric_limits<double>::infinity();
  const double sigma =
      at_rest ? params.align.level_sigma_mps2 : params.align.moving_level_sigma_mps2;
  // As a measurement, so that tilt and accelerometer bias become correlated.
  b = update(b, level(b.x, force, gravity_, sigma), kNoGate).belief;
  b.x.rate_vehicle = stillness_.mean_rate;
  set_variance(kRate, 3, 0.0, &b.P);
  if (!at_rest) return b;
  set_variance(kVelocity, 3, params.stillness.sigma_mps, &b.P);
  // At rest the gyro measures its bias and the earth's rate; without a heading the latter is noise.
  constexpr double kEarthRate = 7.3e-5;
  const double noise = params.ins.angle_random_walk * params.ins.angle_random_walk / sum_s_ +
                       kEarthRate * kEarthRate;
  const double prior = params.ins.gyro_turn_on * params.ins.gyro_turn_on;
  b.x.gyro_bias = prior / (prior + noise) * (sum_angle_ / sum_s_);
  set_variance(kGyroBias, 3, std::sqrt(prior * noise / (prior + noise)), &b.P);
  return b;
}

std::optional<Georeference> HeadingFinder::add(Stamp stamp, const GpsFix& fix,
                                               const FilterState& state, const WmParams& params) {
  const NavState& x = state.belief.x;
  const Vec3 p_old = x.T_world_vehicle * params.gps.lever_m + x.v_world * seconds(stamp - x.stamp);
  // Fixes without a baseline to the previous one would only fill the table.
  const double spacing = params.align.baseline_m / 8.0;
  if (count_ > 0 && (fix.p_world - pairs_[count_ - 1].p_new).norm() < spacing) {
    return by_course(stamp, fix, state, params);
  }
  if (count_ == pairs_.size()) {
    std::move(pairs_.begin() + 1, pairs_.end(), pairs_.begin());
    --count_;
  }
  pairs_[count_++] = {stamp, p_old, fix.p_world, yaw_of(x.T_world_vehicle.q),
                      fix.sigma_m.head<2>().maxCoeff()};
  if (std::optional<Georeference> course = by_course(stamp, fix, state, params)) return course;
  if (std::optional<Georeference> path = by_path(params.align)) return path;
  if (knows_velocity(state)) return std::nullopt;
  return params.odometry.constrained ? by_positions(state, params) : by_motion(state, params);
}

std::optional<Georeference> HeadingFinder::by_path(const AlignParams& params) const {
  Vec3 mean_old = Vec3::Zero();
  Vec3 mean_new = Vec3::Zero();
  for (std::size_t i = 0; i < count_; ++i) {
    mean_old += pairs_[i].p_old / static_cast<double>(count_);
    mean_new += pairs_[i].p_new / static_cast<double>(count_);
  }
  double cross = 0.0, dot = 0.0, spread2 = 0.0, sigma = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3 a = pairs_[i].p_old - mean_old;
    const Vec3 b = pairs_[i].p_new - mean_new;
    cross += a.x() * b.y() - a.y() * b.x();
    dot += a.x() * b.x() + a.y() * b.y();
    spread2 += b.head<2>().squaredNorm();
    sigma = std::max(sigma, pairs_[i].sigma_m);
  }
  const Vec2 baseline = (pairs_[count_ - 1].p_new - pairs_[0].p_new).head<2>();
  if (count_ < 3 || baseline.norm() < params.baseline_m) return std::nullopt;
  const double yaw = std::atan2(cross, dot);
  const Pose T_new_old = turn_and_shift(yaw, mean_old, mean_new);
  double misfit2 = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    misfit2 += (T_new_old * pairs_[i].p_old - pairs_[i].p_new).head<2>().squaredNorm() /
               static_cast<double>(count_);
  }
  // Time-correlated errors of GPS cancel in differences; this is not relied on.
  const double error = std::sqrt(2.0 * sigma * sigma + misfit2);
  const double sigma_yaw = error / std::sqrt(spread2);
  // Many fixes would make the angle of any two paths seem certain.
  constexpr double kAlike = 0.1;
  const bool alike = misfit2 * static_cast<double>(count_) < kAlike * spread2;
  if (!alike || sigma_yaw > params.heading_sigma_rad) return std::nullopt;
  return Georeference{T_new_old, sigma_yaw, 3.0 * error, pairs_[count_ - 1].stamp, {}};
}

std::optional<Georeference> HeadingFinder::by_course(Stamp stamp, const GpsFix& fix,
                                                     const FilterState& state,
                                                     const WmParams& params) const {
  const NavState& x = state.belief.x;
  const double speed = fix.v_world.head<2>().norm();
  if (!fix.has_velocity || count_ == 0 || !(speed > params.align.course_speed_mps)) {
    return std::nullopt;
  }
  const double sigma_gps = fix.sigma_v_mps.head<2>().norm() / speed;
  const double sigma_own = std::sqrt(state.belief.P.diagonal().segment<2>(kVelocity).sum()) / speed;
  if (sigma_gps > params.align.heading_sigma_rad) return std::nullopt;
  const double course = std::atan2(fix.v_world.y(), fix.v_world.x());
  const Vec3 p_old = x.T_world_vehicle * params.gps.lever_m;
  // On rough ground the antenna swings as fast as the vehicle drives.
  const Vec3 swing = x.T_world_vehicle.q * x.rate_vehicle.cross(params.gps.lever_m);
  const double sigma_m = 3.0 * fix.sigma_m.maxCoeff();
  if (sigma_own < params.align.heading_sigma_rad) {
    // Two velocities of one vehicle differ in direction only. Wheels that are stuck, or a vehicle
    // that is carried, have a velocity of zero in no direction.
    const Vec3 own = x.v_world + swing;
    const double faster = own.head<2>().norm() - speed;
    const double allowed = kSameSpeed * speed + 3.0 * std::hypot(sigma_gps, sigma_own) * speed;
    if (std::abs(faster) > allowed) return std::nullopt;
    const double own_course = std::atan2(own.y(), own.x());
    const double yaw = wrap_angle(course - own_course);
    // The fix is fused next, with those of the last second: here it only chooses where to begin.
    return Georeference{turn_and_shift(yaw, p_old, fix.p_world),
                        kFusedNext * std::hypot(sigma_gps, sigma_own),
                        sigma_m,
                        stamp,
                        {}};
  }
  if (!params.odometry.constrained) return std::nullopt;  // its course is not its heading
  // No own measurement of the velocity: a car drives forward, up to its side slip.
  const double yaw = wrap_angle(course - yaw_of(x.T_world_vehicle.q));
  const double slip = std::hypot(kSideSlip, swing.head<2>().norm() / speed);
  const Pose T_new_old = turn_and_shift(yaw, p_old, fix.p_world);
  Georeference a{T_new_old, std::hypot(sigma_gps, slip), sigma_m, stamp, Georeference::Motion{}};
  a.motion->v = fix.v_world;
  a.motion->p = T_new_old * x.T_world_vehicle.p;
  a.motion->sigma_mps = std::max(fix.sigma_v_mps.maxCoeff(), slip * speed);
  return a;
}

/// The same from the chord between two fixes. While a car turns evenly, the chord has the direction
/// of its heading in the middle of it.
std::optional<Georeference> HeadingFinder::by_positions(const FilterState& state,
                                                        const WmParams& params) const {
  constexpr Duration kLongest = from_seconds(3.0);
  constexpr double kBraking_mps2 = 2.0;
  const NavState& x = state.belief.x;
  const Pair& now = pairs_[count_ - 1];
  for (std::size_t k = count_ - 1; k-- > 0;) {
    const Pair& then = pairs_[k];
    if (now.stamp - then.stamp > kLongest) break;
    const double dt = seconds(now.stamp - then.stamp);
    const Vec3 chord = now.p_new - then.p_new;
    const double length = chord.head<2>().norm();
    const double sigma = std::sqrt(2.0) * std::max(now.sigma_m, then.sigma_m);
    const double sigma_yaw = std::hypot(sigma / length, kSideSlip);
    if (length < params.align.baseline_m || length < params.align.course_speed_mps * dt ||
        sigma / length > params.align.heading_sigma_rad) {
      continue;
    }
    const double turned = wrap_angle(now.yaw_old - then.yaw_old);
    const double course = std::atan2(chord.y(), chord.x());
    const double yaw = wrap_angle(course - (now.yaw_old - 0.5 * turned));
    const Pose T_new_old = turn_and_shift(yaw, now.p_old, now.p_new);
    const Vec3 v_world = Quat(Eigen::AngleAxisd(0.5 * turned, Vec3::UnitZ())) * chord / dt;
    Georeference a{T_new_old, sigma_yaw, 3.0 * now.sigma_m, now.stamp, Georeference::Motion{}};
    a.motion->v = v_world;
    a.motion->p = T_new_old * (x.T_world_vehicle.p + x.v_world * seconds(now.stamp - x.stamp));
    a.motion->sigma_mps = std::hypot(sigma / dt, kSideSlip * length / dt, kBraking_mps2 * 0.5 * dt);
    return a;
  }
  return std::nullopt;
}

/// Fit of a path that the INS has integrated from an unknown velocity with an unknown tilt:
/// p_new = R(yaw) p_old + shift + v t + a t^2 / 2, horizontally; observable when the vehicle turns
/// or changes its speed. Linear in cos(yaw) and sin(yaw), which a good fit finds on the unit
/// circle.
std::optional<Georeference> HeadingFinder::by_motion(const FilterState& state,
                                                     const WmParams& params) const {
  constexpr Duration kLongest = from_seconds(12.0);  // tilt and biases are not constant for longer
  constexpr int kUnknowns = 8;
  constexpr double kOffCircle = 0.15;
  if (!uses_forces(state)) return std::nullopt;
  const Pair& now = pairs_[count_ - 1];
  std::size_t first = count_ - 1;
  while (first > 0 && now.stamp - pairs_[first - 1].stamp <= kLongest) --first;
  const std::size_t n = count_ - first;
  if (n <= kUnknowns) return std::nullopt;

  using Vec8 = Eigen::Matrix<double, kUnknowns, 1>;
  using Mat8 = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  const auto variance = state.belief.P.diagonal();
  const double leak = Earth{}.gravity * std::sqrt(variance.segment<2>(kAttitude).maxCoeff()) +
                      std::sqrt(variance.segment<2>(kAccelBias).maxCoeff());
  Mat8 H = Mat8::Zero();
  Vec8 b = Vec8::Zero();
  double squares = 0.0, sigma = 0.0;
  for (std::size_t i = first; i < count_; ++i) {
    const Vec3 from = pairs_[i].p_old - now.p_old;
    const Vec3 to = pairs_[i].p_new - now.p_new;
    const double t = seconds(pairs_[i].stamp - now.stamp);
    Eigen::Matrix<double, 2, kUnknowns> J;
    J << from.x(), -from.y(), 1.0, 0.0, t, 0.0, 0.5 * t * t, 0.0,  //
        from.y(), from.x(), 0.0, 1.0, 0.0, t, 0.0, 0.5 * t * t;
    H += J.transpose() * J;
    b += J.transpose() * to.head<2>();
    squares += to.head<2>().squaredNorm();
    sigma = std::max(sigma, pairs_[i].sigma_m);
  }
  H.diagonal().tail<2>().array() += square(sigma / leak);
  const Eigen::LDLT<Mat8> factors(H);
  if (factors.info() != Eigen::Success || !factors.isPositive()) return std::nullopt;
  const Vec8 u = factors.solve(b);
  const double misfit2 = std::max(0.0, squares - u.dot(b)) / static_cast<double>(2 * n - kUnknowns);
  const double error2 = 2.0 * sigma * sigma + misfit2;
  const Mat8 cofactors = factors.solve(Mat8::Identity());
  const double radius = std::hypot(u[0], u[1]);
  const Vec2 across = Vec2(-u[1], u[0]) / radius;
  const double sigma_yaw =
      std::sqrt(error2 * across.dot(cofactors.topLeftCorner<2, 2>() * across)) / radius;
  if (!(sigma_yaw < params.align.heading_sigma_rad && std::abs(radius - 1.0) < kOffCircle)) {
    return std::nullopt;
  }
  const auto sigma_of = [&](int k) { return std::sqrt(error2 * cofactors(k, k)); };
  const double yaw = std::atan2(u[1], u[0]);
  Georeference a;
  a.T_new_old = turn_and_shift(yaw, now.p_old, now.p_new + Vec3(u[2], u[3], 0.0));
  a.sigma_yaw_rad = sigma_yaw;
  a.sigma_m = 3.0 * std::sqrt(error2);
  a.stamp = now.stamp;
  a.motion = Georeference::Motion{Vec3(u[4], u[5], 0.0),
                                  std::max(sigma_of(4), sigma_of(5)),
                                  {},
                                  Vec3(u[6], u[7], 0.0),
                                  std::max(sigma_of(6), sigma_of(7))};
  return a;
}

namespace {

/// The errors of the path were not independent of one another: what is corrected begins again.
/// @param dt_s  from the instant of the corrections to that of the belief
void correct_motion(const Georeference::Motion& m, double dt_s, Belief* b) {
  const auto renew = [b](int index, double sigma) {
    b->P.middleRows<3>(index).setZero();
    b->P.middleCols<3>(index).setZero();
    set_variance(index, 3, sigma, &b->P);
  };
  NavState& x = b->x;
  renew(kPosition, 1e-3);
  renew(kVelocity, m.sigma_mps);
  if (m.p) {
    x.T_world_vehicle.p = *m.p + m.v * dt_s;
    x.v_world = m.v;
    return;
  }
  x.T_world_vehicle.p += m.v * dt_s + 0.5 * square(dt_s) * m.a;
  x.v_world += m.v + m.a * dt_s;
  const double g = Earth{}.gravity;
  const Vec3 tilt = Vec3::UnitZ().cross(m.a) / g;
  x.T_world_vehicle.q = (exp_so3(tilt) * x.T_world_vehicle.q).normalized();
  const double bias2 = b->P.diagonal().segment<2>(kAccelBias).maxCoeff();
  renew(kAttitude, std::sqrt(square(m.sigma_mps2) + bias2) / g);
}

}  // namespace

void georeference(const Georeference& a, FilterState* s) {
  const Pose before = s->belief.x.T_world_vehicle;
  s->belief = change_world(s->belief, a.T_new_old);
  if (a.motion) correct_motion(*a.motion, seconds(s->belief.x.stamp - a.stamp), &s->belief);
  s->belief = loosen_world(s->belief, Vec3::Constant(a.sigma_m), a.sigma_yaw_rad);
  Bookkeeping& m = s->bookkeeping;
  m.georeferenced = true;
  ++m.world_resets;
  const Pose step = before.inverse() * s->belief.x.T_world_vehicle;
  m.last_reset_m = step.p.norm();
  m.last_reset_rad = log_so3(step.q).norm();
  m.last_reset = s->belief.x.stamp;
}

std::optional<Georeference> georeference_by_map(const PriorMatch& match, const NavState& x,
                                                const AlignParams& params) {
  const Eigen::LDLT<Mat6> information(match.information);
  if (information.info() != Eigen::Success || !information.isPositive()) return std::nullopt;
  const Mat6 covariance = information.solve(Mat6::Identity());
  const Mat3 R = match.T_world_vehicle.rotation();
  const Mat3 place = R * covariance.topLeftCorner<3, 3>() * R.transpose();
  const Mat3 turn = R * covariance.bottomRightCorner<3, 3>() * R.transpose();
  Georeference a;
  a.sigma_m = std::sqrt(place.diagonal().maxCoeff());
  a.sigma_yaw_rad = std::sqrt(turn(2, 2));
  // Written so that NaN is rejected.
  if (!(a.sigma_m < params.baseline_m && a.sigma_yaw_rad < params.heading_sigma_rad)) {
    return std::nullopt;
  }
  const Pose T_old = T_world_seen(x);
  const double yaw = wrap_angle(yaw_of(match.T_world_vehicle.q) - yaw_of(T_old.q));
  a.T_new_old = turn_and_shift(yaw, T_old.p, match.T_world_vehicle.p);
  return a;
}

void georeference_on_map(const Georeference& a, const MapBias& bias, FilterState* s) {
  georeference(a, s);
  s->bookkeeping.map_bias = bias;
  renew_map_offset(bias.sigma_m, &s->belief);
  // All that was shifted into frame world, including the rolling map, has the bias of the survey.
  const Belief shifted = loosen_world(s->belief, Vec3::Constant(bias.sigma_m), 0.0);
  const Mat<kSize, 3> shared =
      shifted.P.middleCols<3>(kPosition) - s->belief.P.middleCols<3>(kPosition);
  s->belief = shifted;
  s->belief.P.middleCols<3>(kMapBias) -= shared;
  s->belief.P.middleRows<3>(kMapBias) -= shared.transpose();
  // The next matches share much of their map errors with this one.
  SourceRecord& record = s->bookkeeping.of(Source::kPriorMap);
  record.accepted = s->belief.x.stamp;
  record.distance_m = s->bookkeeping.distance_m;
}

}  // namespace rcs::wm
