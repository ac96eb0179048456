#include "modules/wm/filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::wm {
namespace {

/// With the modelled bias of the a priori map here, and the drift of the rolling map as measured.
DriveNoise drive_noise(const Model& model, const FilterState& s) {
  const Bookkeeping& m = s.bookkeeping;
  DriveNoise noise = model.params.drive;
  const LadarScale scale = model.ladar_scales.at(s.belief.x.stamp);
  noise.rolling_position *= scale.position;
  noise.rolling_angle *= scale.rotation;
  if (m.map_bias.sigma_m > 0.0) {
    noise.map_sigma_m = m.map_bias.sigma_m;
    noise.map_length_m = m.map_bias.length_m;
  }
  return noise;
}

void after_prediction(const Model& model, const NavState& before, FilterState* s) {
  const NavState& x = s->belief.x;
  Bookkeeping& m = s->bookkeeping;
  const double dt = seconds(x.stamp - before.stamp);
  const Pose step = before.T_world_vehicle.inverse() * x.T_world_vehicle;
  m.T_path_vehicle = m.T_path_vehicle * step;
  m.T_local_vehicle = m.T_local_vehicle * step;
  m.uncorrected = step.inverse() * m.uncorrected * step;
  // Position noise of a vehicle at rest is not distance.
  if (x.v_world.norm() > model.params.stillness.speed_mps) {
    m.distance_m += step.p.norm();
  }
  m.accel_vehicle = x.T_world_vehicle.q.conjugate() * ((x.v_world - before.v_world) / dt);
}

/// The body rate at the moment when the INS falls silent.
Belief lose_gyro(const Model& model, const FilterState& s) {
  const MotionNoise& noise = model.params.motion;
  const double rocking = std::sqrt(0.5 * s.bookkeeping.stillness.variance_rate);  // two axes'
  return without_gyro(s.belief, s.bookkeeping.lasting.yaw_rate,
                      {rocking, rocking, std::max(noise.rate_sigma, rocking)});
}

/// Second process model, in steps short against a turn.
void coast(const Model& model, Stamp to, FilterState* s) {
  constexpr Duration kStep = from_milliseconds(100.0);
  if (s->belief.x.inertial && s->belief.x.stamp < to) {
    s->belief = lose_gyro(model, *s);
    s->bookkeeping.ins_lost = s->belief.x.stamp;
  }
  while (s->belief.x.stamp < to) {
    const NavState before = s->belief.x;
    s->belief = predict(s->belief, std::min(to, before.stamp + kStep), model.params.motion,
                        model.params.ins, drive_noise(model, *s));
    after_prediction(model, before, s);
  }
}

/// The INS is received again: its rate also says by how much the vehicle has turned meanwhile, as
/// the two are correlated in the second process model. A rate that is impossible says nothing. Not
/// for the first sample of all: what the rate was before is not known then.
void regain_gyro(const Model& model, const ImuSample& imu, FilterState* s) {
  constexpr double kWithin_radps = 0.05;  // by which the rate may change within the sample
  const NavState& x = s->belief.x;
  const Vec3 earth_vehicle = x.T_world_vehicle.q.conjugate() * model.earth.rate_world;
  Residual<3> z;
  z.r = imu.delta_angle / seconds(imu.interval) - (x.gyro_bias + earth_vehicle) - x.rate_vehicle;
  z.H.block<3, 3>(0, kRate).setIdentity();
  z.H.block<3, 3>(0, kGyroBias).setIdentity();
  z.R = kWithin_radps * kWithin_radps * Mat3::Identity();
  s->belief = update(s->belief, z, model.gates[3]).belief;
}

bool stands(const Model& model, const FilterState& s) {
  const StillnessParams& p = model.params.stillness;
  const Bookkeeping& m = s.bookkeeping;
  if (!model.params.odometry.zero_velocity || !m.stillness.quiet(p)) return false;
  const Stamp odometry = m.odometry_received;
  const bool fresh = odometry > s.belief.x.stamp - from_seconds(p.window_s);
  const double speed = fresh ? std::abs(m.odometry_mps) : s.belief.x.v_world.norm();
  return speed < p.speed_mps;
}

constexpr double kLevelAfter_s = 0.5;  // of INS samples after a gap

/// After a gap of the INS roll and pitch may have become uncertain: then by the mean specific
/// force.
void level_if_uncertain(const Model& model, FilterState* s) {
  constexpr double kUncertain_rad = 0.05;
  constexpr double kNoGate = std::numeric_limits<double>::infinity();
  const double variance = s->belief.P.diagonal().segment<2>(kAttitude).maxCoeff();
  if (variance < kUncertain_rad * kUncertain_rad || s->bookkeeping.excluded.force) return;
  const Residual<3> z = level(s->belief.x, s->bookkeeping.stillness.mean_force, model.earth.gravity,
                              model.params.align.moving_level_sigma_mps2);
  s->belief = update(s->belief, z, kNoGate).belief;
}

/// Frame local is level, as frame world is. After a silence the attitude of both may be wrong by
/// degrees; where gravity then corrects that in frame world, the local pose must not keep it: it
/// would tilt all terrain that is seen from now on against what was seen before.
void keep_local_level(FilterState* s) {
  constexpr double kTilted_rad = 0.0175;
  constexpr double kKnown_rad = 0.01;
  const NavState& x = s->belief.x;
  Quat& q_local = s->bookkeeping.T_local_vehicle.q;
  const Vec3 up = q_local * (x.T_world_vehicle.q.conjugate() * Vec3::UnitZ());
  if (up.head<2>().norm() < kTilted_rad || !uses_forces(*s)) return;
  const double variance = s->belief.P.diagonal().segment<2>(kAttitude).maxCoeff();
  if (variance > kKnown_rad * kKnown_rad) return;
  q_local = (Quat::FromTwoVectors(up, Vec3::UnitZ()) * q_local).normalized();
}

}  // namespace

void RejectedMatches::add(Stamp now, const Vec3& displacement_m) {
  constexpr Duration kConsecutive = from_seconds(0.5);
  const bool consecutive = stamp != Stamp::min() && now > stamp && now - stamp < kConsecutive;
  rate_mps = consecutive ? Vec3((displacement_m - apart_m) / seconds(now - stamp)) : Vec3::Zero();
  apart_m = displacement_m;
  stamp = now;
}

Vec3 RejectedMatches::displacement(Stamp now, bool still_rejected) const {
  constexpr Duration kNewest = from_seconds(1.0);
  constexpr Duration kNext = from_seconds(0.3);  // until matches are rejected again after a reset
  Vec3 sum_m = Vec3::Zero();
  if (still_rejected && stamp > now - kNewest) {
    sum_m += apart_m + seconds(now - stamp) * rate_mps;
  }
  if (reset > now - kResetLasts) {
    sum_m += reset_m + seconds(std::min(now - reset, kNext)) * rate_mps;
  }
  return sum_m;
}

void Stillness::add(const ImuSample& imu, double window_s) {
  const double dt = seconds(imu.interval);
  const Vec3 rate = imu.delta_angle / dt;
  const Vec3 force = imu.delta_v / dt;
  if (seen_s == 0.0) {
    mean_rate = rate;
    mean_force = force;
  }
  seen_s += dt;
  const double a = std::min(1.0, dt / window_s);
  variance_rate += a * ((rate - mean_rate).squaredNorm() - variance_rate);
  variance_force += a * ((force - mean_force).squaredNorm() - variance_force);
  mean_rate += a * (rate - mean_rate);
  mean_force += a * (force - mean_force);
}

bool Stillness::quiet(const StillnessParams& p) const {
  return seen_s > 2.0 * p.window_s && variance_rate < p.rate_radps * p.rate_radps &&
         variance_force < p.accel_mps2 * p.accel_mps2;
}

Model::Model(const WmParams& p) : params(p) {
  for (std::size_t dof = 1; dof < gates.size(); ++dof) {
    gates[dof] = chi_square_gate(static_cast<int>(dof), p.false_alarm);
  }
}

void advance(const Model& model, Stamp to, const ImuSample* next_imu, FilterState* s,
             Innovations* records) {
  if (to < s->belief.x.stamp) return;
  if (next_imu == nullptr || s->bookkeeping.excluded.ins) {
    coast(model, to, s);
    return;
  }
  const ImuSample& imu = *next_imu;
  Bookkeeping& m = s->bookkeeping;
  Stamp begin = imu.stamp - imu.interval;
  double share_of_interval = 1.0;
  Duration held{};
  const bool was_silent =
      m.ins_stamp != Stamp::min() && begin - m.ins_stamp > model.params.history.bridge;
  if (m.ins_stamp != Stamp::min() && begin - m.ins_stamp <= model.params.history.bridge) {
    // Jittering stamps: the increments are right, the stamps are not. A lost sample: the next one
    // is extended over its interval.
    const Duration gap = begin - m.ins_stamp;
    begin = m.ins_stamp;
    if (std::abs(gap.count()) * 2 > imu.interval.count()) {
      share_of_interval = seconds(imu.stamp - begin) / seconds(imu.interval);
      held = std::max(gap, Duration::zero());
    }
  }
  if (s->belief.x.stamp < begin) coast(model, std::min(to, begin), s);
  if (to > s->belief.x.stamp) {
    if (!s->belief.x.inertial && m.ins_stamp != Stamp::min()) regain_gyro(model, imu, s);
    const NavState before = s->belief.x;
    const double share =
        share_of_interval * seconds(to - before.stamp) / seconds(imu.stamp - begin);
    const ImuSample part{to, to - before.stamp, share * imu.delta_angle, share * imu.delta_v};
    const DriveNoise drive = drive_noise(model, *s);
    const WmParams& params = model.params;
    s->belief = m.excluded.force
                    ? predict_by_rotation(s->belief, part, model.earth, params.motion, params.ins,
                                          drive, m.lasting)
                    : predict(s->belief, part, model.earth, params.ins, drive, m.lasting);
    after_prediction(model, before, s);
  }
  if (to != imu.stamp) return;

  m.ins_stamp = imu.stamp;
  if (was_silent) {
    m.ins_gap_end = imu.stamp;
    m.level_due = true;
    m.stillness.seen_s = 0.0;  // its means begin again
  }
  if (held > Duration::zero()) {  // variance that the second process model would have added
    const double t = seconds(held);
    const double qa = model.params.motion.acceleration;
    const double qw =
        std::max(model.params.motion.angular_acceleration, model.params.motion.yaw_acceleration);
    s->belief.P.diagonal().segment<3>(kVelocity).array() += qa * qa * t;
    s->belief.P.diagonal().segment<3>(kAttitude).array() += qw * qw * t * t * t / 3.0;
  }
  m.stillness.add(imu, model.params.stillness.window_s);
  m.lasting.add(imu, model.earth.gravity, model.params.ins.motion_time_s);
  if (m.level_due && m.stillness.seen_s >= kLevelAfter_s) {
    m.level_due = false;
    level_if_uncertain(model, s);
  }
  keep_local_level(s);
  SourceRecord& record = m.of(Source::kZeroVelocity);
  const bool due = record.accepted == Stamp::min() ||
                   imu.stamp - record.accepted >= model.params.stillness.period;
  if (!due || !stands(model, *s)) return;
  const Residual<3> z = zero_velocity(s->belief.x, model.params.stillness);
  const Fusion<3> f = update(s->belief, z, model.gates[3]);
  Innovation i{imu.stamp, Source::kZeroVelocity, f.reason, 3, f.nis, model.gates[3]};
  i.r.head<3>() = z.r;
  i.sigma.head<3>() = f.sigma;
  records->add(i);
  if (f.reason != Reason::kAccepted) return;
  s->belief = f.belief;
  record = {imu.stamp, m.distance_m};
}

void count_reset(const ModeParams& params, const Pose& before, FilterState* s) {
  const Pose step = before.inverse() * s->belief.x.T_world_vehicle;
  const double angle = log_so3(step.q).norm();
  if (step.p.norm() <= params.reset_m && angle <= params.reset_rad) return;
  Bookkeeping& m = s->bookkeeping;
  ++m.world_resets;
  m.last_reset_m = step.p.norm();
  m.last_reset_rad = angle;
  m.last_reset = s->belief.x.stamp;
}

}  // namespace rcs::wm
