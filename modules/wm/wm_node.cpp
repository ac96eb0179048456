#include "modules/wm/wm_node.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/message_names.h"
#include "lcmtypes/plausible.h"
#include "modules/wm/wm_messages_node.h"
#include "rcs/node/budget.h"

namespace rcs::wm {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr Duration kIntegrityPeriod = from_milliseconds(100.0);
constexpr Duration kSubfilterPeriod = from_milliseconds(500.0);

/// Of 5 s at 200 Hz: a process that was stopped continues without a gap.
constexpr std::size_t kInsSamples = 1024;
/// Fewer than the history keeps.
constexpr int kInputsBetweenFusions = 256;

}  // namespace

WmNode::WmNode(const WmConfig& config, Bus* bus, PriorTerrain prior, std::string no_map)
    : config_(config),
      clock_(config.period),
      ins_(bus, channel::kIns, kInsSamples),
      fixes_(bus, channel::kGpsFix, 16),
      odometry_(bus, channel::kOdometry, 64),
      registrations_(bus, channel::kSpRegistration, 8),
      nav_state_out_(bus, channel::kWmNavState),
      innovation_out_(bus, channel::kWmInnovation),
      integrity_out_(bus, channel::kWmIntegrity),
      subfilter_out_(bus, channel::kWmSubfilter),
      report_(bus, config.info.name, kReportInterval),
      estimator_(config.params, config.datum),
      terrain_(config, bus),
      path_uncertainty_(config.path_uncertainty, std::move(prior), bus),
      no_map_(std::move(no_map)),
      integrity_clock_(kIntegrityPeriod),
      subfilter_clock_(kSubfilterPeriod) {}

std::vector<const InboxBase*> WmNode::inboxes() const {
  return {&ins_,           &fixes_,           &odometry_,
          &registrations_, &terrain_.inbox(), &path_uncertainty_.inbox()};
}

Stamp WmNode::next_wakeup() const {
  return std::min(registrations_.oldest_arrival(), clock_.next());
}

void WmNode::begin(Stamp now) {
  kept_.local_began = now;
  if (checkpoint_) resume(now);
  if (!no_checkpoint_.empty()) {
    report_.publish(now, event::kWmResumed,
                    "{}: a WM that is started again cannot continue with the belief",
                    no_checkpoint_);
  }
  if (no_map_.empty()) return;
  report_.publish(now, event::kWmMapNone,
                  "{}: path uncertainty is predicted without the a priori map", no_map_);
}

void WmNode::resume(Stamp now) {
  using Result = CheckpointKeeper::Result;
  const Result result = checkpoint_->resume(now, &estimator_, &terrain_, &kept_);
  const double age_s = seconds(checkpoint_->age());
  switch (result) {
    case Result::kNone:
      return;
    case Result::kResumed:
      reported_epoch_ = estimator_.state().belief.x.map_epoch;
      reported_resets_ = estimator_.state().bookkeeping.world_resets;
      report_.publish(now, event::kWmResumed,
                      "belief, frame local and terrain continued from {:.2f} s before", age_s);
      return;
    case Result::kTerrain:
      return;  // reported when a scan has verified it
    case Result::kTooOld:
      report_.publish(
          now, event::kWmResumed,
          "start without belief and terrain of {:.1f} s before: a belief is used for "
          "{:.0f} s and in the same run, terrain for {:.0f} s and if the vehicle was at "
          "rest",
          age_s, seconds(CheckpointKeeper::kOldest), seconds(CheckpointKeeper::kOldestTerrain));
      return;
    case Result::kNotProven:
      report_.publish(
          now, event::kWmResumed,
          "start without the last belief: the process ended soon after it had continued "
          "with it");
  }
}

// This process did not run, and SP has begun another rolling map meanwhile: ground seen before
// would lie beside ground seen from now on.
void WmNode::keep_local(Stamp now) {
  if (estimator_.local_breaks() == local_breaks_) return;
  local_breaks_ = estimator_.local_breaks();
  if (!checkpoint_) return;
  kept_.local_began = now;
  terrain_.clear();
  report_.publish(now, event::kWmInputNone,
                  "frame local and terrain begin again: the motion during a silence of all inputs "
                  "is not known");
}

void WmNode::run(const Cycle& cycle) {
  if (kept_.local_began == Stamp::min()) begin(cycle.now);
  accept_all(&ins_, cycle.now);
  accept_all(&odometry_, cycle.now);
  accept_all(&fixes_, cycle.now);
  accept_all(&registrations_, cycle.now);
  estimator_.watch_clocks(cycle.now);
  cycle.stages->mark("receive");

  estimator_.fuse();
  if (const Stamp to = estimator_.started() ? estimator_.state().belief.x.stamp : Stamp::min();
      to != moved_to_) {
    moved_to_ = to;
    moved_at_ = cycle.now;
  }
  keep_local(cycle.now);
  cycle.stages->mark("fuse");

  publish_innovations();
  publish_nav_state(cycle.now);
  if (integrity_clock_.due(cycle.now)) {
    publish_integrity(cycle.now);
    integrity_clock_.advance(cycle.now);
  }
  if (subfilter_clock_.due(cycle.now)) {
    publish_subfilters();
    subfilter_clock_.advance(cycle.now);
  }
  report_events(cycle.now);
  report_inputs(cycle.now);
  report_alignment(cycle.now);
  cycle.stages->mark("publish");

  if (checkpoint_) checkpoint_->before_terrain(estimator_, terrain_);
  terrain_.step(estimator_, kept_.local_began, cycle.now, &report_);
  cycle.stages->mark("terrain");
  const bool absolute = estimator_.started() && estimator_.state().bookkeeping.georeferenced;
  path_uncertainty_.step(absolute ? &estimator_.state() : nullptr,
                         estimator_.datum() ? &*estimator_.datum() : nullptr, cycle.now, &report_);
  cycle.stages->mark("path_uncertainty");
  if (checkpoint_) {
    checkpoint_->save(cycle.now, estimator_, terrain_, kept_);
    cycle.stages->mark("checkpoint");
  }
  if (clock_.due(cycle.now)) clock_.advance(cycle.now);
  cycle.stages->close_account();
}

template <class Message>
void WmNode::accept_all(Inbox<Message>* inbox, Stamp now) {
  for (int n = 1; !inbox->empty(); ++n, inbox->pop()) {
    accept(*inbox->front(), now);
    if (n % kInputsBetweenFusions == 0) estimator_.fuse();
  }
}

namespace {

/// Messages between two sequence numbers; 0: they are not of one publisher, or implausible.
std::int64_t missed_between(std::int64_t before, std::int64_t now) {
  constexpr std::int64_t kMax = 1'000'000;
  if (before <= 0 || now <= before) return 0;
  const std::int64_t missed = now - before - 1;
  return missed <= kMax ? missed : 0;
}

/// A repeated or older stamp is no sign of life: a driver may be stuck.
bool is_alive(Reason reason) { return reason == Reason::kAccepted || reason == Reason::kNoDatum; }

}  // namespace

void WmNode::accept(const ins_t& m, Stamp now) {
  const InsFault fault = ins_content_.add(m);
  if (fault != InsFault::kNone && plausible(m)) {
    estimator_.discard_ins(from_utime(ins_content_.wrong_since()), from_utime(m.utime));
  }
  const std::optional<ImuSample> sample = fault == InsFault::kNone ? admit(m) : std::nullopt;
  const Stamp arrival = ins_.front_arrival();
  const Reason reason = sample ? estimator_.add(*sample, arrival) : Reason::kInvalid;
  if (is_alive(reason)) inputs_.add(Input::kIns, sample->stamp, arrival);
  if (fault == InsFault::kNone || !plausible(m)) {
    report_rejected(ins_, reason, now, &report_);
  } else {
    report_rejected(ins_, name_of(fault), now, &report_);
  }
}

void WmNode::accept(const gps_fix_t& m, Stamp now) {
  constexpr Duration kFresh = from_seconds(1.0);
  const bool rolls = wheels_received_ > fixes_.front_arrival() - kFresh;
  const bool repeats = !gps_content_.add(m, rolls ? wheels_mps_ : 0.0);
  const std::optional<GeodeticFix> fix = admit(m);
  if (fix && repeats) {
    estimator_.watch_clock(Clock::kGps, from_utime(m.utime), fixes_.front_arrival());
    report_rejected(fixes_, "the same position while moving (frozen receiver)", now, &report_);
    return;
  }
  const Stamp stamp = from_utime(m.utime);
  const Stamp arrival = fixes_.front_arrival();
  const Reason reason = fix ? estimator_.add(stamp, *fix, arrival) : Reason::kInvalid;
  if (fix) fixes_have_velocity_ = fix->fix.has_velocity;
  if (is_alive(reason)) inputs_.add(Input::kGps, stamp, arrival);
  report_rejected(fixes_, reason, now, &report_);
}

void WmNode::accept(const odometry_t& m, Stamp now) {
  const bool repeats = !odometry_content_.add(m);
  const std::optional<OdometrySample> sample = admit(m);
  if (!sample) {
    report_rejected(odometry_, Reason::kInvalid, now, &report_);
    return;
  }
  // The mean of an interval is the value at its middle.
  const Stamp middle = from_utime(m.utime) - Duration(m.interval_us / 2);
  const Stamp arrival = odometry_.front_arrival();
  if (repeats) {
    estimator_.watch_clock(Clock::kOdometry, middle, arrival);
    report_rejected(odometry_, "eight equal samples in a row while moving (frozen sensor)", now,
                    &report_);
    return;
  }
  wheels_mps_ = m.speed_mps;
  wheels_received_ = arrival;
  const Reason reason = estimator_.add(middle, *sample, arrival);
  if (is_alive(reason)) inputs_.add(Input::kOdometry, middle, arrival);
  report_rejected(odometry_, reason, now, &report_);
}

void WmNode::accept(const registration_t& m, Stamp now) {
  const Stamp arrival = registrations_.front_arrival();
  const std::int64_t missed = missed_between(kept_.registration_seq, m.seq);
  kept_.registration_seq = m.seq;
  if (!is_answer(m.stop)) {  // no result; SP has reported the reason
    if (plausible_stamp(m.utime)) {
      estimator_.watch_clock(Clock::kLadar, from_utime(m.utime), arrival);
    }
    return;
  }
  if (plausible_stamp(m.utime)) inputs_.add_newer(Input::kLadar, from_utime(m.utime), arrival);
  const std::optional<Registration> z = admit(m);
  if (!z) {
    report_rejected(registrations_, Reason::kInvalid, now, &report_);
    return;
  }
  const Stamp stamp = from_utime(m.utime);
  const bool seeded = m.stop == registration_t::STOP_SEEDED;
  Reason reason = Reason::kInvalid;
  if (m.target == registration_t::TARGET_ROLLING && m.map_epoch >= 0) {
    const RollingMatch match{z->T_target_vehicle, z->information, m.map_epoch, seeded, missed};
    reason = estimator_.add(stamp, match, arrival);
  } else if (m.target == registration_t::TARGET_PRIOR_MAP && !seeded) {
    reason = estimator_.add(stamp,
                            PriorMatch{z->T_target_vehicle,
                                       z->information,
                                       z->tile_id,
                                       {m.map_bias_sigma_m, m.map_bias_length_m}},
                            arrival);
  }
  report_rejected(registrations_, reason, now, &report_);
  if (reason == Reason::kAccepted && stamp >= cause_) {
    cause_ = stamp;
    // A scan has up to two registrations: its latency trace ends with the first.
    if (m.latency_trace.measured_utime != latency_trace_.measured_utime) {
      latency_trace_ = m.latency_trace;
      latency_trace_.wm_arrival_utime = to_utime(registrations_.front_arrival());
    }
  }
}

void WmNode::publish_innovations() {
  for (const Innovation& i : estimator_.innovations()) {
    innovation_.utime = to_utime(i.stamp);
    innovation_.source = static_cast<std::int8_t>(i.source);
    innovation_.accepted = i.reason == Reason::kAccepted ? 1 : 0;
    innovation_.reason = static_cast<std::int8_t>(i.reason);
    innovation_.dof = static_cast<std::int16_t>(i.dof);
    innovation_.nis = i.nis;
    innovation_.gate = i.gate;
    for (int k = 0; k < 6; ++k) {
      innovation_.innovation[k] = i.r[k];
      innovation_.sigma[k] = i.sigma[k];
    }
    innovation_out_.publish(&innovation_);
  }
  estimator_.clear_innovations();
}

/// Excess of the time without any input, or of that in which none has moved the belief: one kind
/// alone without INS does not.
Duration WmNode::without_input_for(Stamp now) const {
  constexpr Duration kStands = from_milliseconds(500.0);
  const Duration silent = inputs_.all_silent_for(now);
  return moved_at_ == Stamp::min() ? silent : std::max(silent, now - moved_at_ - kStands);
}

/// Without any input the mode is LOST, whatever sources the belief rests on.
Mode WmNode::mode(Stamp now) const {
  return without_input_for(now) > Duration::zero() ? Mode::kLost : estimator_.mode();
}

void WmNode::publish_nav_state(Stamp now) {
  if (!estimator_.started()) return;  // no belief yet
  const FilterState& s = estimator_.state();
  // If the stamps of two other sources show that the INS is silent, the belief advances without it.
  // If the INS is received again with older stamps, no belief is published until it passes the
  // newest published one: published time never runs backward.
  const bool same_clock = estimator_.clock_steps() == published_clock_steps_;
  if (same_clock && s.belief.x.stamp < published_) return;
  published_ = s.belief.x.stamp;
  published_clock_steps_ = estimator_.clock_steps();
  fill_belief(s, now);
  nav_state_.mode = static_cast<std::int8_t>(mode(now));
  nav_state_.pose_valid = without_input_for(now) <= config_.params.modes.input_timeout ? 1 : 0;
  const bool rests_on_scan = cause_ > Stamp::min() && cause_ <= s.belief.x.stamp;
  if (rests_on_scan && latency_trace_.wm_start_utime == 0) {
    latency_trace_.wm_start_utime = to_utime(now);
  }
  nav_state_.latency_trace = rests_on_scan ? latency_trace_ : latency_trace_t{};
  nav_state_.publish_utime = to_utime(now);
  nav_state_out_.publish(&nav_state_);
}

void WmNode::fill_belief(const FilterState& s, Stamp now) {
  const NavState& x = s.belief.x;
  const Bookkeeping& memory = s.bookkeeping;
  nav_state_t& m = nav_state_;
  m.utime = to_utime(x.stamp);

  // Before the world is georeferenced, the local pose is published for frame world.
  const Pose& T_out_vehicle =
      memory.georeferenced ? x.T_world_vehicle : estimator_.T_local_vehicle();
  const Mat3 R_out_world = (T_out_vehicle.q * x.T_world_vehicle.q.conjugate()).toRotationMatrix();
  m.world_valid = memory.georeferenced ? 1 : 0;
  to_message(T_out_vehicle, m.q_world_vehicle, m.p_world_vehicle_m);
  m.local_utime = to_utime(kept_.local_began);
  to_message(estimator_.T_local_vehicle(), m.q_local_vehicle, m.p_local_vehicle_m);
  to_message(Vec3(R_out_world * x.v_world), m.v_world_mps);
  const Mat3 cov_v = s.belief.P.block<3, 3>(kVelocity, kVelocity);
  to_message<3>(R_out_world * cov_v * R_out_world.transpose(), m.cov_v_world);
  to_message(world_pose_covariance(s.belief, config_.params.ins.mount_sigma_rad), m.cov_world_pose);

  m.rolling_valid = x.map_epoch >= 0 ? 1 : 0;
  m.map_epoch = x.map_epoch;
  to_message(x.map_epoch >= 0 ? T_rolling_vehicle(x) : Pose{}, m.q_rolling_vehicle,
             m.p_rolling_vehicle_m);
  to_message(rolling_pose_covariance(s.belief), m.cov_rolling_pose);

  to_message(x.rate_vehicle, m.rate_vehicle_radps);
  to_message(memory.accel_vehicle, m.accel_vehicle_mps2);
  to_message(x.gyro_bias, m.gyro_bias_radps);
  to_message(x.accel_bias, m.accel_bias_mps2);
  to_message(x.map_bias, m.prior_map_bias_m);
  m.wheel_scale = x.wheel_scale;

  m.world_resets = memory.world_resets;
  m.last_reset_m = memory.last_reset_m;
  m.last_reset_rad = memory.last_reset_rad;
  m.last_reset_utime = memory.world_resets > 0 ? to_utime(memory.last_reset) : 0;
  fill_ages(s, now);
  m.distance_since_gps_m = distance_since_gps_m(s);
  if (const std::optional<LocalFrame>& frame = estimator_.datum()) {
    m.datum_lat_deg = degrees(frame->datum().lat_rad);
    m.datum_lon_deg = degrees(frame->datum().lon_rad);
    m.datum_height_m = frame->datum().height.m;
  }
}

void WmNode::fill_ages(const FilterState& s, Stamp now) {
  const auto age_us = [&](Duration by_sensor, Input input) {
    // Node time counts where sensor time stands still; otherwise the two differ by latencies only.
    constexpr Duration kLatency = from_milliseconds(100.0);
    const Duration silence = inputs_.silence(input, now);
    const bool stands = by_sensor >= Duration::zero() && inputs_.silent(input, now) &&
                        silence > by_sensor + kLatency;
    return (stands ? silence : by_sensor).count();
  };
  const Ages a = ages(s);
  nav_state_.ins_shift_us = estimator_.ins_clock_shift().count();
  nav_state_.age_ins_us = age_us(a.ins, Input::kIns);
  nav_state_.age_gps_us = age_us(a.gps, Input::kGps);
  nav_state_.age_odometry_us = age_us(a.odometry, Input::kOdometry);
  nav_state_.age_rolling_us = age_us(a.rolling, Input::kLadar);
  nav_state_.age_prior_map_us = age_us(a.prior_map, Input::kLadar);
}

void WmNode::publish_integrity(Stamp now) {
  if (!estimator_.started()) return;
  const FilterState& s = estimator_.state();
  const FaultDetection& fault_detection = estimator_.fault_detection();
  const WmParams& params = config_.params;
  const Integrity found = integrity(s, fault_detection, without_input_for(now), params);
  integrity_t& m = integrity_;
  const std::int64_t utime = to_utime(s.belief.x.stamp);
  const auto gps = static_cast<std::int8_t>(fault_detection.gps(s, params.modes));
  const auto ladar = static_cast<std::int8_t>(fault_detection.ladar(s, params.modes));
  const std::int8_t ins =
      inputs_.silent(Input::kIns, now) || s.bookkeeping.ins_stamp == Stamp::min()
          ? integrity_t::STATUS_NONE
          : static_cast<std::int8_t>(fault_detection.ins(s));
  if (m.utime == 0 || ins != m.ins) m.ins_since_utime = utime;
  if (m.utime == 0 || gps != m.gps) m.gps_since_utime = utime;
  if (m.utime == 0 || ladar != m.ladar) m.ladar_since_utime = utime;
  m.utime = utime;
  m.validity = static_cast<std::int8_t>(found.validity);
  m.protection_horizontal_m = found.protection_horizontal_m;
  m.protection_vertical_m = found.protection_vertical_m;
  m.limit_horizontal_m = params.integrity.limit_horizontal_m;
  m.limit_vertical_m = params.integrity.limit_vertical_m;
  m.alerts = static_cast<std::int8_t>(found.alerts);
  m.ins = ins;
  m.gps = gps;
  m.ladar = ladar;
  m.gps_test_ratio = fault_detection.gps_test_ratio();
  m.ladar_test_ratio = fault_detection.ladar_test_ratio();
  m.sigma_in_60s_m = found.sigma_in_60s_m;
  m.alert_in_s = found.alert_in_s;
  integrity_out_.publish(&m);
  report_source_status(now);
}

void WmNode::publish_subfilters() {
  const FaultDetection& fault_detection = estimator_.fault_detection();
  if (!estimator_.started() || !estimator_.state().bookkeeping.georeferenced) return;
  for (const Without what : {Without::kAll, Without::kLadar, Without::kGps}) {
    const Subfilter& subfilter = fault_detection.subfilter(what);
    if (!subfilter.alive()) continue;
    const Belief& belief = subfilter.state.belief;
    subfilter_.utime = to_utime(belief.x.stamp);
    subfilter_.kind = static_cast<std::int8_t>(what);
    subfilter_.branch_utime = to_utime(subfilter.branch);
    to_message(belief.x.T_world_vehicle, subfilter_.q_world_vehicle, subfilter_.p_world_vehicle_m);
    to_message(world_pose_covariance(belief, config_.params.ins.mount_sigma_rad),
               subfilter_.cov_world_pose);
    subfilter_out_.publish(&subfilter_);
  }
}

namespace {

Result<std::unique_ptr<Node>> make_node(const ParamFile& file, Bus* bus, bool live) {
  const Result<WmConfig> config = load_wm_config(file);
  if (!config) return config.error();
  // A path is processed point by point: only the terrain that a scan sees there, and the cells next
  // to it, is in memory.
  PriorTerrainParams around = config->prior_terrain;
  around.window.radius_m = 2.0 * config->path_uncertainty.radius_m;
  // The filter does not depend on the map.
  Result<PriorTerrain> prior = open_prior_terrain(around, live);
  std::string no_map = prior ? std::string() : prior.error().message;
  auto node = std::make_unique<WmNode>(
      *config, bus, prior ? std::move(prior).value() : PriorTerrain(), std::move(no_map));
  if (live) {
    Result<std::unique_ptr<CheckpointMemory>> memory =
        CheckpointMemory::of_this_process(node->checkpoint_layout(), file.text_id());
    if (!memory) {
      node->state_no_checkpoint(memory.error().message);
    } else if (*memory) {
      node->use(std::move(memory).value(), bus->publisher());
    }
  }
  return std::unique_ptr<Node>(std::move(node));
}

}  // namespace

Result<std::unique_ptr<Node>> make_wm_node(const ParamFile& file, Bus* bus) {
  return make_node(file, bus, false);
}

Result<std::unique_ptr<Node>> make_live_wm_node(const ParamFile& file, Bus* bus) {
  return make_node(file, bus, true);
}

}  // namespace rcs::wm
