#include "tools/studies/dead_reckoning.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "rcs/node/log/log_source.h"
#include "tools/drills/drill_stimulus.h"

namespace rcs::studies {
namespace {

constexpr double kUncovered_s = 0.5;

template <class T>
bool decode(const SourceEvent& event, T* m) {
  const int size = static_cast<int>(event.data.size());
  return m->decode(event.data.data(), 0, size) == size;
}

/// Seconds of a sample's interval that lie between two moments.
template <class Sample>
double overlap_s(const Sample& s, Stamp from, Stamp to) {
  return seconds(std::min(s.stamp, to) - std::max(s.stamp - s.interval, from));
}

template <class Sample>
auto first_after(const std::vector<Sample>& samples, Stamp t) {
  return std::upper_bound(samples.begin(), samples.end(), t,
                          [](Stamp at, const Sample& s) { return at < s.stamp; });
}

/// The wheel sample of a moment: the one whose interval contains it, else the nearest.
const WheelSample* wheels_at(const std::vector<WheelSample>& wheels, Stamp t) {
  const auto after = first_after(wheels, t);
  const WheelSample* best = after == wheels.end() ? nullptr : &*after;
  const bool covers = best != nullptr && best->stamp - best->interval <= t;
  if (!covers && after != wheels.begin()) {
    const WheelSample* before = &*(after - 1);
    if (best == nullptr || t - before->stamp < best->stamp - best->interval - t) best = before;
  }
  const bool near = best != nullptr && t - best->stamp < from_seconds(kUncovered_s) &&
                    best->stamp - best->interval - t < from_seconds(kUncovered_s);
  return near ? best : nullptr;
}

struct Moving {
  Pose T_world_vehicle;
  Vec3 v_world;
};

std::optional<Geodetic> place_of(const SourceEvent& event) {
  gps_fix_t fix{};
  if (!decode(event, &fix)) return std::nullopt;
  const Geodetic g{radians(fix.lat_deg), radians(fix.lon_deg), {fix.height_m}};
  return plausible(g) ? std::optional<Geodetic>(g) : std::nullopt;
}

void turn_and_roll(const Vec3& turn_rad, double way_m, Moving* m) {
  const Quat half = m->T_world_vehicle.q * exp_so3(0.5 * turn_rad);
  m->T_world_vehicle.p += half * Vec3(way_m, 0.0, 0.0);
  m->T_world_vehicle.q = (m->T_world_vehicle.q * exp_so3(turn_rad)).normalized();
}

void fall_free_but_for(const Vec3& turn_rad, const Vec3& dv_vehicle, const Vec3& earth_rate,
                       double gravity_mps2, double dt_s, Moving* m) {
  const Quat half = m->T_world_vehicle.q * exp_so3(0.5 * turn_rad);
  const Vec3 v_before = m->v_world;
  m->v_world += half * dv_vehicle +
                dt_s * (Vec3(0.0, 0.0, -gravity_mps2) - 2.0 * earth_rate.cross(m->v_world));
  m->T_world_vehicle.p += 0.5 * dt_s * (v_before + m->v_world);
  const Quat turned = m->T_world_vehicle.q * exp_so3(turn_rad);
  m->T_world_vehicle.q = (exp_so3(-dt_s * earth_rate) * turned).normalized();
}

/// Samples without an interval cover the time since the previous one.
void hold_since_the_one_before(std::vector<WheelSample>* wheels) {
  for (std::size_t k = 1; k < wheels->size(); ++k) {
    WheelSample& s = (*wheels)[k];
    if (s.interval > Duration::zero()) continue;
    s.interval = std::min(s.stamp - (*wheels)[k - 1].stamp, from_seconds(kUncovered_s));
  }
}

/// Bias-corrected increments of an INS sample within its share of an interval.
struct Increment {
  Stamp middle;
  double dt_s = 0.0;
  Vec3 turn_rad;
  Vec3 dv_mps;
};

std::vector<Increment> increments(const ReckoningStart& start, const RecordedMotion& motion,
                                  Stamp to) {
  std::vector<Increment> all;
  for (auto s = first_after(motion.inertial, start.stamp); s != motion.inertial.end(); ++s) {
    const double dt_s = overlap_s(*s, start.stamp, to);
    if (dt_s <= 0.0) continue;
    const double share = dt_s / seconds(s->interval);
    all.push_back({s->stamp - s->interval / 2, dt_s,
                   share * s->delta_angle - dt_s * start.gyro_bias_radps,
                   share * s->delta_v - dt_s * start.accel_bias_mps2});
  }
  return all;
}

// Each returns the time covered by samples [s].

double by_wheels(const ReckoningStart& start, const RecordedMotion& motion, Stamp to, Moving* m) {
  double covered_s = 0.0;
  for (auto s = first_after(motion.wheels, start.stamp); s != motion.wheels.end(); ++s) {
    const double dt_s = overlap_s(*s, start.stamp, to);
    if (dt_s <= 0.0 || !std::isfinite(s->yaw_rate_radps)) continue;
    const Vec3 turn_rad(0.0, 0.0, dt_s * s->yaw_rate_radps);
    turn_and_roll(turn_rad, dt_s * s->speed_mps / start.wheel_scale, m);
    covered_s += dt_s;
  }
  return covered_s;
}

double by_gyro_and_wheels(const ReckoningStart& start, const RecordedMotion& motion, Stamp to,
                          Moving* m) {
  double covered_s = 0.0;
  for (const Increment& i : increments(start, motion, to)) {
    const WheelSample* wheels = wheels_at(motion.wheels, i.middle);
    if (wheels == nullptr) continue;
    turn_and_roll(i.turn_rad, i.dt_s * wheels->speed_mps / start.wheel_scale, m);
    covered_s += i.dt_s;
  }
  return covered_s;
}

double by_gyro_and_last_speed(const ReckoningStart& start, const RecordedMotion& motion, Stamp to,
                              Moving* m) {
  const double speed_mps = (start.T_world_vehicle.q.conjugate() * start.v_world).x();
  double covered_s = 0.0;
  for (const Increment& i : increments(start, motion, to)) {
    turn_and_roll(i.turn_rad, i.dt_s * speed_mps, m);
    covered_s += i.dt_s;
  }
  return covered_s;
}

double by_ins(const ReckoningStart& start, const RecordedMotion& motion, Stamp to, Moving* m) {
  if (!motion.place) return 0.0;
  const Vec3 earth_rate = earth_rate_world(motion.place->lat_rad);
  const double gravity_mps2 = normal_gravity(motion.place->lat_rad, motion.place->height);
  double covered_s = 0.0;
  for (const Increment& i : increments(start, motion, to)) {
    fall_free_but_for(i.turn_rad, i.dv_mps, earth_rate, gravity_mps2, i.dt_s, m);
    covered_s += i.dt_s;
  }
  return covered_s;
}

}  // namespace

Result<RecordedMotion> read_motion(const std::string& log) {
  Result<LogReader> reader = LogReader::open(log);
  if (!reader) return reader.error();
  LogSource source(&reader.value(), drills::drive_channels());
  RecordedMotion motion;
  SourceEvent event;
  ins_t ins{};
  odometry_t wheels{};
  for (Stamp due = source.peek(); due != Stamp::max(); due = source.peek()) {
    source.take(&event);
    motion.has_truth = motion.has_truth || event.channel == channel::kSimTruth;
    if (!drills::publishes_on(drills::DrillSource::kAll, event.channel)) continue;
    if (!motion.begin) motion.begin = due;
    motion.end = due;
    if (!motion.place && event.channel == channel::kGpsFix) motion.place = place_of(event);
    motion.has_ladar =
        motion.has_ladar || drills::publishes_on(drills::DrillSource::kLadar, event.channel);
    if (event.channel == channel::kIns && decode(event, &ins) && ins.valid != 0) {
      motion.inertial.push_back({from_utime(ins.utime), Duration(ins.interval_us),
                                 from_message(ins.delta_angle_rad), from_message(ins.delta_v_mps)});
    }
    if (event.channel == channel::kOdometry && decode(event, &wheels)) {
      motion.wheels.push_back({from_utime(wheels.utime), Duration(wheels.interval_us),
                               wheels.speed_mps, wheels.yaw_rate_radps});
    }
  }
  const auto by_stamp = [](const auto& a, const auto& b) { return a.stamp < b.stamp; };
  std::stable_sort(motion.inertial.begin(), motion.inertial.end(), by_stamp);
  std::stable_sort(motion.wheels.begin(), motion.wheels.end(), by_stamp);
  hold_since_the_one_before(&motion.wheels);
  if (!reader->health().good()) motion.damage = reader->health().summary();
  return motion;
}

std::optional<Pose> reckon(ReckonedBy by, const ReckoningStart& start, const RecordedMotion& motion,
                           Stamp to) {
  Moving m{start.T_world_vehicle, start.v_world};
  double covered_s = 0.0;
  switch (by) {
    case ReckonedBy::kGyroAndWheels:
      covered_s = by_gyro_and_wheels(start, motion, to, &m);
      break;
    case ReckonedBy::kGyroAndLastSpeed:
      covered_s = by_gyro_and_last_speed(start, motion, to, &m);
      break;
    case ReckonedBy::kWheels:
      covered_s = by_wheels(start, motion, to, &m);
      break;
    case ReckonedBy::kInertial:
      covered_s = by_ins(start, motion, to, &m);
      break;
  }
  if (covered_s < seconds(to - start.stamp) - kUncovered_s) return std::nullopt;
  return m.T_world_vehicle;
}

}  // namespace rcs::studies
