#include "tools/drills/drill_recorder.h"

#include <algorithm>
#include <limits>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "tools/drills/drill_stimulus.h"
#include "tools/evaluation/evaluation.h"
#include "tools/recording/message_fields.h"

namespace rcs::drills {
namespace {

constexpr std::uint64_t kFnvBasis = 0xcbf29ce484222325ULL;
constexpr std::uint64_t kFnvPrime = 0x100000001b3ULL;

Geodetic geodetic(double lat_deg, double lon_deg, double height_m) {
  return {radians(lat_deg), radians(lon_deg), EllipsoidalHeight{height_m}};
}

bool is_event(std::string_view channel) {
  return channel == channel::kSpEvent || channel == channel::kWmEvent;
}

bool is_bulky(std::string_view channel) {
  return publishes_on(DrillSource::kLadar, channel) || channel == channel::kSpPoints ||
         channel == channel::kWmMapPatch;
}

}  // namespace

DrillRecorder::DrillRecorder(const std::vector<Stimulus>& stimuli, const DrillReference* reference,
                             LogWriter* log)
    : has_reference_(reference != nullptr), log_(log) {
  for (const Stimulus& s : stimuli) {
    const bool clocks = s.kind == StimulusKind::kClock && s.source == DrillSource::kAll;
    if (clocks) jumps_.push_back(from_seconds(s.jump_s));
  }
  record_.hash = kFnvBasis;
  if (reference == nullptr) return;
  record_.truth = reference->poses;
  datum_ = reference->datum;
}

template <class T, class Take>
void DrillRecorder::with(const std::uint8_t* data, std::size_t size, T* message, Take take_it) {
  if (message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size)) take_it(*message);
}

void DrillRecorder::on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                               std::size_t size) {
  const bool sensor = publishes_on(DrillSource::kAll, channel);
  if (sensor && !record_.begin) {
    // Sensor time: the event stamps of a live log are of another clock (ADR 1).
    if (const auto head = recording::read_head(channel, data, size)) {
      record_.begin = from_utime(head->utime);
      to_sensor_time_ = *record_.begin - due;
    }
  }
  const Stamp at = due + to_sensor_time_;
  if (sensor) record_.end = at;
  if (!sensor && channel != channel::kSimTruth) hash(channel, data, size);
  if (log_ != nullptr && !is_bulky(channel)) (void)log_->write(due, channel, data, size);

  if (channel == channel::kSimTruth) {
    with(data, size, &truth_, [this](const truth_t& m) { take(m); });
  } else if (channel == channel::kWmNavState) {
    with(data, size, &nav_, [&](const nav_state_t& m) { take(m, at); });
  } else if (channel == channel::kGpsFix) {
    with(data, size, &fix_, [&](const gps_fix_t& m) { take(m, at); });
  } else if (channel == channel::kWmInnovation) {
    with(data, size, &innovation_, [&](const innovation_t& m) { take(m, at); });
  } else if (channel == channel::kWmIntegrity) {
    with(data, size, &integrity_, [&](const integrity_t& m) { take(m, at); });
  } else if (channel == channel::kWmSubfilter) {
    with(data, size, &subfilter_, [&](const subfilter_t& m) { take(m, at); });
  } else if (channel == channel::kSpRegistration) {
    with(data, size, &registration_, [&](const registration_t& m) { take(m, at); });
  } else if (is_event(channel)) {
    with(data, size, &event_, [&](const event_t& m) {
      record_.events.push_back({at, m.node, m.severity, m.code, m.text});
    });
  }
}

Stamp DrillRecorder::undisturbed(std::string_view channel, std::int64_t utime, Stamp due) {
  const Stamp stamp = from_utime(utime);
  if (jumps_.empty()) return stamp;
  const Duration age = due - stamp;
  const auto first = first_age_.emplace(channel, age).first;
  Duration best{};
  const auto miss = [&](Duration jump) { return std::abs((age + jump - first->second).count()); };
  for (const Duration jump : jumps_) {
    if (miss(jump) < miss(best)) best = jump;
  }
  return stamp - best;
}

void DrillRecorder::hash(std::string_view channel, const std::uint8_t* data, std::size_t size) {
  const auto add = [this](std::uint8_t byte) { record_.hash = (record_.hash ^ byte) * kFnvPrime; };
  for (const char c : channel) add(static_cast<std::uint8_t>(c));
  for (std::size_t i = 0; i < size; ++i) add(data[i]);
}

void DrillRecorder::take(const truth_t& m) {
  tools::StampedPose truth{from_utime(m.utime), {}};
  if (has_reference_ || !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &truth.T)) return;
  const bool ascends = record_.truth.empty() || truth.stamp > record_.truth.back().stamp;
  if (!ascends) return;
  if (!datum_) datum_ = geodetic(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
  record_.truth.push_back(truth);
  record_.v_truth_world.push_back(from_message(m.v_world_mps));
}

void DrillRecorder::take(const nav_state_t& m, Stamp due) {
  DrillBelief b;
  b.stamp = undisturbed(channel::kWmNavState, m.utime, due);
  Pose T_world;
  if (m.world_valid == 0 || !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world) ||
      !from_message(m.q_local_vehicle, m.p_local_vehicle_m, &b.T_local_vehicle)) {
    return;
  }
  const Vec3 world_datum(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
  if (world_datum != world_datum_deg_m_) {
    const Geodetic g = geodetic(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
    if (!plausible(g)) return;
    world_datum_deg_m_ = world_datum;
    if (!datum_) datum_ = g;
    T_truth_world_ = evaluation::between_worlds(*datum_, g);
  }
  b.T_world_vehicle = *T_truth_world_ * T_world;
  b.v_local = b.T_local_vehicle.q * (T_world.q.conjugate() * from_message(m.v_world_mps));
  b.accel_local = b.T_local_vehicle.q * from_message(m.accel_vehicle_mps2);
  b.gyro_bias_radps = from_message(m.gyro_bias_radps);
  b.accel_bias_mps2 = from_message(m.accel_bias_mps2);
  b.wheel_scale = m.wheel_scale;
  b.cov_world_pose = from_message(m.cov_world_pose);
  const Mat3 R_truth_world = T_truth_world_->rotation();
  b.v_world = R_truth_world * from_message(m.v_world_mps);
  b.cov_v_world = R_truth_world * from_message(m.cov_v_world) * R_truth_world.transpose();
  b.mode = m.mode;
  record_.beliefs.push_back(b);
}

void DrillRecorder::take(const gps_fix_t& m, Stamp due) {
  DrillFix f;
  f.stamp = undisturbed(channel::kGpsFix, m.utime, due);
  f.arrival = due;
  f.utime = m.utime;
  f.sigma_m = from_message(m.sigma_enu_m);
  double height_m = m.height_m;
  if (m.height_kind == gps_fix_t::HEIGHT_ORTHOMETRIC) height_m += m.undulation_m;
  const Geodetic g = geodetic(m.lat_deg, m.lon_deg, height_m);
  f.p_world = datum_ && plausible(g) ? LocalFrame(*datum_).to_world(g)
                                     : Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  record_.fixes.push_back(f);
}

void DrillRecorder::take(const innovation_t& m, Stamp due) {
  DrillInnovation i{undisturbed(channel::kWmInnovation, m.utime, due),
                    due,
                    m.utime,
                    m.source,
                    m.accepted != 0,
                    m.reason,
                    m.dof,
                    m.nis};
  for (int k = 0; k < std::min<int>(m.dof, 6); ++k) {
    if (m.sigma[k] > 0.0) i.normalized[k] = m.innovation[k] / m.sigma[k];
  }
  record_.innovations.push_back(i);
}

void DrillRecorder::take(const integrity_t& m, Stamp due) {
  record_.integrity.push_back({undisturbed(channel::kWmIntegrity, m.utime, due),
                               m.protection_horizontal_m, m.protection_vertical_m,
                               m.limit_horizontal_m, m.limit_vertical_m, m.alerts, m.gps, m.ladar});
}

void DrillRecorder::take(const subfilter_t& m, Stamp due) {
  Pose T_world;
  if (!T_truth_world_ || !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world)) return;
  record_.subfilters.push_back({undisturbed(channel::kWmSubfilter, m.utime, due),
                                from_utime(m.branch_utime), m.kind, *T_truth_world_ * T_world});
}

void DrillRecorder::take(const registration_t& m, Stamp due) {
  if (m.target != registration_t::TARGET_ROLLING) return;
  ++record_.stops[std::string(recording::stop_name(m.stop))];
  DrillMatch match;
  match.stamp = undisturbed(channel::kSpRegistration, m.utime, due);
  match.epoch = m.map_epoch;
  if (!is_answer(m.stop) ||
      !from_message(m.q_target_vehicle, m.p_target_vehicle_m, &match.T_rolling_vehicle)) {
    return;
  }
  record_.matches.push_back(match);
}

}  // namespace rcs::drills
