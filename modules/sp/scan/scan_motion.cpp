#include "modules/sp/scan/scan_motion.h"

#include <algorithm>

#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

// Increments of one interval, or of a part of it.
struct Increment {
  double dt_s;
  Vec3 angle_rad;
  Vec3 dv_mps;
};

// dt_s > 0 integrates forward, < 0 undoes such a step.
void step(const Increment& u, MotionState* s) {
  const double dt = u.dt_s;
  const Quat q_half = s->T_rolling_vehicle.q * exp_so3(0.5 * u.angle_rad);
  const Vec3 dv = q_half * u.dv_mps + s->gravity_rolling * dt;
  s->T_rolling_vehicle.p += (s->v_rolling + 0.5 * dv) * dt;
  s->T_rolling_vehicle.q = (s->T_rolling_vehicle.q * exp_so3(u.angle_rad)).normalized();
  s->v_rolling += dv;
}

void coast_for(double dt_s, MotionState* s) {
  const Vec3 v_vehicle = s->T_rolling_vehicle.q.conjugate() * s->v_rolling;
  Vec6 xi;
  xi << v_vehicle * dt_s, s->rate_vehicle_radps * dt_s;
  s->T_rolling_vehicle = s->T_rolling_vehicle * exp_se3(xi);
  s->v_rolling = s->T_rolling_vehicle.q * v_vehicle;
}

Increment part_of(const InertialSample& sample, const MotionState& s, double dt_s) {
  const double interval_s = seconds(sample.interval);
  const double share = dt_s / interval_s;
  return {dt_s, sample.delta_angle_rad * share - s.gyro_bias_radps * dt_s,
          sample.delta_v_mps * share - s.accel_bias_mps2 * dt_s};
}

}  // namespace

InertialBuffer::InertialBuffer(std::size_t capacity) : samples_(capacity) {
  RCS_CHECK(capacity > 0);
}

bool InertialBuffer::add(const InertialSample& sample) {
  if (count_ > 0 && sample.stamp <= (*this)[count_ - 1].stamp) {
    if (++refused_ < kClockStepped) return false;
    clear();
  }
  refused_ = 0;
  if (count_ == samples_.size()) {
    head_ = (head_ + 1) % samples_.size();
    --count_;
  }
  samples_[(head_ + count_) % samples_.size()] = sample;
  ++count_;
  return true;
}

MotionState propagate(const MotionState& state, const InertialBuffer& inertial, Stamp stamp) {
  MotionState s = state;
  if (stamp >= s.stamp) {
    for (std::size_t i = 0; i < inertial.size() && s.stamp < stamp; ++i) {
      const InertialSample& sample = inertial[i];
      if (sample.stamp <= s.stamp) continue;
      const Stamp begin = std::max(s.stamp, sample.stamp - sample.interval);
      if (begin >= stamp) break;
      if (begin > s.stamp) coast_for(seconds(begin - s.stamp), &s);  // a gap in the samples
      const Stamp end = std::min(sample.stamp, stamp);
      step(part_of(sample, s, seconds(end - begin)), &s);
      s.stamp = end;
    }
    if (s.stamp < stamp) coast_for(seconds(stamp - s.stamp), &s);
  } else {
    for (std::size_t i = inertial.size(); i-- > 0 && s.stamp > stamp;) {
      const InertialSample& sample = inertial[i];
      const Stamp begin = sample.stamp - sample.interval;
      if (begin >= s.stamp) continue;
      if (sample.stamp <= stamp) break;
      if (sample.stamp < s.stamp) {
        coast_for(seconds(sample.stamp - s.stamp), &s);
        s.stamp = sample.stamp;
      }
      const Stamp end = std::max(begin, stamp);
      const Increment u = part_of(sample, s, seconds(s.stamp - end));
      // Backward: the state before the step, solved from the equations of the step.
      const Quat q_before = (s.T_rolling_vehicle.q * exp_so3(-u.angle_rad)).normalized();
      const Vec3 dv =
          (q_before * exp_so3(0.5 * u.angle_rad)) * u.dv_mps + s.gravity_rolling * u.dt_s;
      s.v_rolling -= dv;
      s.T_rolling_vehicle.p -= (s.v_rolling + 0.5 * dv) * u.dt_s;
      s.T_rolling_vehicle.q = q_before;
      s.stamp = end;
    }
    if (s.stamp > stamp) coast_for(-seconds(s.stamp - stamp), &s);
  }
  s.stamp = stamp;
  return s;
}

MotionState coast(const MotionState& state, Stamp stamp) {
  MotionState s = state;
  coast_for(seconds(stamp - s.stamp), &s);
  s.stamp = stamp;
  return s;
}

void tabulate_motion(const MotionState& state, const InertialBuffer& inertial, Stamp reference,
                     Duration first, Duration last, MotionTable* table) {
  RCS_CHECK(first <= last);
  constexpr int kKnots = 32;  // 3 ms apart at 10 Hz: the chord of 30 deg/s over that is 0.02 mrad
  table->first = first;
  table->step = std::max(Duration(1), (last - first) / (kKnots - 1) + Duration(1));
  table->T_reference_vehicle.clear();
  const MotionState at_reference = propagate(state, inertial, reference);
  const Pose T_reference_rolling = at_reference.T_rolling_vehicle.inverse();
  MotionState s = propagate(at_reference, inertial, reference + first);
  for (int k = 0; k < kKnots; ++k) {
    table->T_reference_vehicle.push_back(T_reference_rolling * s.T_rolling_vehicle);
    s = propagate(s, inertial, s.stamp + table->step);
  }
}

}  // namespace rcs::sp
