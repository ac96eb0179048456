#include "modules/sp/sp_node.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/plausible.h"
#include "modules/sp/sp_messages_node.h"

namespace rcs::sp {
namespace {

constexpr double kGravity_mps2 = 9.80665;
// A larger step of the scan numbers is a restarted driver, not a loss.
constexpr std::int64_t kMaxDropped = 1000;

// True if the covariance of a message can be inverted after a small addition.
bool usable_covariance(const Mat6& c) {
  return c.allFinite() && c.diagonal().minCoeff() >= 0.0 && c.diagonal().maxCoeff() < 1e8 &&
         Mat6(c + isotropic(0.01, 0.001)).llt().info() == Eigen::Success;
}

/// WM uses no INS: it is silent, or excluded.
bool without_ins(std::int8_t mode) {
  return mode == nav_state_t::MODE_GPS_LADAR || mode == nav_state_t::MODE_LADAR ||
         mode == nav_state_t::MODE_LOST;
}

}  // namespace

SpNode::SpNode(const SpConfig& config, PriorTerrain prior, Bus* bus)
    : config_(config),
      prior_(std::move(prior)),
      start_(config, prior_),
      ranges_(bus, channel::kLadarRanges, 48),
      facets_(bus, channel::kLadarPoints, 144),
      ins_(bus, channel::kIns, 256),
      nav_states_(bus, channel::kWmNavState, 8),
      registration_out_(bus, channel::kSpRegistration),
      points_out_(bus),
      report_(bus, config.info.name, from_seconds(1.0)),
      assembler_(config.ladar),
      inertial_(256),
      map_(config.map) {
  reserve();
  if (config_.start && config_.datum) prior_.set_datum(*config_.datum);
}

// The size of a range image is known: no cycle allocates for it. Scans of Cartesian points grow the
// buffers until the largest has been received.
void SpNode::reserve() {
  const auto n =
      static_cast<std::size_t>(config_.ladar.rows) * static_cast<std::size_t>(config_.ladar.cols);
  assembler_.scan()->reserve(n);
  as_measured_.reserve(n);
  for (Points* points : {&dense_, &source_, &last_seen_}) points->reserve(n);
  map_sampler_.reserve(n);
  source_sampler_.reserve(n);
  prior_scan_.reserve(n);
  map_.reserve(n);
  icp_.matches.reserve(n);
  icp_.found[0].reserve(n);
  icp_.pairs_of_voxel.resize(map_.voxel_ids());
  prior_match_.matches.reserve(n);
  prior_match_.points.reserve(n);
  prior_match_.standing.matches.reserve(n);
  prior_match_.standing.points.reserve(n);
  points_out_.reserve(n);
}

std::vector<const InboxBase*> SpNode::inboxes() const {
  return {&ranges_, &facets_, &ins_, &nav_states_};
}

Stamp SpNode::next_wakeup() const {
  Stamp next = std::min(ranges_.oldest_arrival(), facets_.oldest_arrival());
  if (assembler_.in_hand()) next = std::min(next, last_facet_arrival_ + config_.facet_timeout);
  return next;
}

Duration SpNode::nominal_compute() const {
  // Only the cycle that completes a scan is expensive: the others convert one facet.
  const auto waiting = static_cast<int>(ranges_.size() + facets_.size());
  int missing = assembler_.facets_missing();
  if (!assembler_.in_hand()) {
    if (waiting == 0) return Duration::zero();
    missing = ranges_.empty() ? facets_.front()->facet_count : ranges_.front()->facet_count;
  }
  return missing <= waiting ? config_.info.nominal_compute : Duration::zero();
}

void SpNode::run(const Cycle& cycle) {
  late_ = std::max(late_, cycle.now - cycle.wakeup);
  take_inertial();
  take_belief(cycle.now);
  if (take_facets(&ranges_, cycle) || take_facets(&facets_, cycle)) return;
  cycle.stages->mark("convert");
  const bool timed_out = assembler_.in_hand() && ranges_.empty() && facets_.empty() &&
                         cycle.now >= last_facet_arrival_ + config_.facet_timeout;
  if (timed_out) finish_scan(cycle);
}

void SpNode::take_inertial() {
  for (const ins_t* m = ins_.front(); m != nullptr; ins_.pop(), m = ins_.front()) {
    // WM reports a rejected sample, as it does repeated and late ones.
    const InsFault fault = ins_content_.add(*m);
    if (!plausible(*m)) continue;
    if (fault != InsFault::kNone) {
      inertial_.discard(from_utime(ins_content_.wrong_since()) + ins_shift_,
                        from_utime(m->utime) + ins_shift_);
      continue;
    }
    if (ins_excluded_) continue;
    static_cast<void>(
        inertial_.add({from_utime(m->utime) + ins_shift_, Duration(m->interval_us),
                       from_message(m->delta_angle_rad), from_message(m->delta_v_mps)}));
  }
}

void SpNode::take_belief(Stamp now) {
  const nav_state_t* m = nav_states_.latest();
  if (m == nullptr) return;
  ins_excluded_ = without_ins(m->mode);
  constexpr std::int64_t kLongest_us = 1'000'000'000'000;
  const Duration shift{std::clamp(m->ins_shift_us, -kLongest_us, kLongest_us)};
  if (shift != ins_shift_) {
    ins_shift_ = shift;
    inertial_.clear();  // its newest samples have stamps of the stepped clock
  }
  motion_guess_.believe(std::nullopt, Mat6::Identity());
  T_world_rolling_.reset();
  T_level_rolling_.reset();
  Pose T_world_vehicle;
  Pose T_rolling_vehicle;
  const Mat6 rolling_covariance = from_message<6>(m->cov_rolling_pose);
  const Mat6 world_covariance = from_message<6>(m->cov_world_pose);
  const bool sound =
      plausible_motion(*m) &&
      from_message(m->q_world_vehicle, m->p_world_vehicle_m, &T_world_vehicle) &&
      from_message(m->q_rolling_vehicle, m->p_rolling_vehicle_m, &T_rolling_vehicle) &&
      usable_covariance(rolling_covariance) && usable_covariance(world_covariance);
  if (!sound) {
    report_.publish(
        now, event::kSpInputRejected,
        "{} rejected: invalid pose, motion or covariance; prediction without WM until the "
        "next valid one",
        channel::kWmNavState);
  }
  if (sound && m->rolling_valid != 0 && m->map_epoch == epoch_) {
    MotionState s;
    const Quat q_rolling_world = T_rolling_vehicle.q * T_world_vehicle.q.conjugate();
    s.stamp = from_utime(m->utime);
    s.T_rolling_vehicle = T_rolling_vehicle;
    s.v_rolling = q_rolling_world * from_message(m->v_world_mps);
    s.gravity_rolling = q_rolling_world * Vec3(0.0, 0.0, -kGravity_mps2);
    s.gyro_bias_radps = from_message(m->gyro_bias_radps);
    s.accel_bias_mps2 = from_message(m->accel_bias_mps2);
    s.rate_vehicle_radps = from_message(m->rate_vehicle_radps);
    motion_guess_.believe(s, rolling_covariance);
    // Upright since WM's start, and continued by LADAR and INS alone.
    if (m->world_valid == 0) T_level_rolling_ = T_world_vehicle * T_rolling_vehicle.inverse();
    const Geodetic datum{radians(m->datum_lat_deg), radians(m->datum_lon_deg), {m->datum_height_m}};
    if (m->world_valid != 0 && prior_.there() && plausible(datum)) {
      T_world_rolling_ = T_world_vehicle * T_rolling_vehicle.inverse();
      world_covariance_ = world_covariance;
      prior_.set_datum(datum);
      start_.stop();
    }
  }
  nav_states_.pop();
}

template <class Message>
bool SpNode::take_facets(Inbox<Message>* inbox, const Cycle& cycle) {
  for (const Message* m = inbox->front(); m != nullptr; m = inbox->front()) {
    const std::optional<FacetId> id = identify(*m, config_.ladar);
    if (!id) {
      ++account_.facets_refused;
      report_.publish(cycle.now, event::kSpFacetRejected,
                      "{} rejected: scan {}, facet {} of {} does not match [ladar] of the "
                      "configuration or its own counts",
                      inbox->channel(), m->scan_id, m->facet, m->facet_count);
      inbox->pop();
      continue;
    }
    const bool begins = !assembler_.in_hand();
    const FacetVerdict verdict = assembler_.add(*id, view(*m));
    if (verdict == FacetVerdict::kNewScan) {
      finish_scan(cycle);  // facets are missing; this one begins the next scan in the next cycle
      return true;
    }
    if (verdict == FacetVerdict::kAdded) {
      last_facet_arrival_ = inbox->front_arrival();
      if (begins) begin_scan(*id);
    } else {
      ++account_.facets_refused;
      report_.publish(
          cycle.now, event::kSpFacetStale, "facet {} of scan {} dropped: {}", m->facet, m->scan_id,
          verdict == FacetVerdict::kOld ? "received after the end of its scan" : "received before");
    }
    inbox->pop();
    if (assembler_.complete()) {
      finish_scan(cycle);
      return true;
    }
  }
  return false;
}

void SpNode::begin_scan(const FacetId& id) {
  first_facet_arrival_ = last_facet_arrival_;
  facet_count_ = id.facet_count;
  const std::int64_t dropped = id.scan - last_scan_ - 1;
  if (last_scan_ >= 0 && dropped > 0 && dropped <= kMaxDropped) account_.dropped += dropped;
  last_scan_ = id.scan;
}

void SpNode::finish_scan(const Cycle& cycle) {
  cycle.stages->mark("convert");
  choose_level(cycle);
  const Stamp measured = assembler_.scan()->reference;
  correct_stamp(cycle);
  choose_reference(assembler_.scan());
  begin_answer(cycle, measured);
  Expectation expected =
      motion_guess_.expect(assembler_.scan()->reference, inertial_, config_.expectation);
  const int facets_lost = assembler_.facets_missing();
  if (facets_lost > 0) {
    report_.publish(cycle.now, event::kSpScanIncomplete,
                    "scan {} incomplete: {} of {} facets missing; registration needs {:.0f} %",
                    assembler_.scan_id(), facets_lost, facet_count_, 100.0 * config_.min_facets);
  }
  if (assembler_.count().not_finite > 0) {
    report_.publish(cycle.now, event::kSpPointsNotFinite,
                    "scan {}: {} ranges or points rejected: not finite", assembler_.scan_id(),
                    assembler_.count().not_finite);
  }
  const bool repeated = repetition_.repeats(assembler_.scan()->points);
  if (ladder_.level == Degrade::kHold) {
    answer_without_registering(registration::Stop::kHeld, expected);
  } else if (repeated) {
    ++account_.failed;
    report_.publish(cycle.now, event::kSpScanRepeated,
                    "scan {} rejected: its {} points are those of the scan before",
                    assembler_.scan_id(), assembler_.scan()->points.size());
    answer_without_registering(registration::Stop::kEmpty, expected);
  } else if (facet_count_ - facets_lost < config_.min_facets * facet_count_) {
    ++account_.failed;
    answer_without_registering(registration::Stop::kTooFew, expected);
  } else {
    prepare_points(cycle, expected);
    decide_stamp(&expected);
    const bool lost = epoch_ != 0 && !expected.known;
    if (lost) {
      report_.publish(cycle.now, event::kSpMapReseeded,
                      "scan {}: no predicted pose in map epoch {}; a new rolling map starts",
                      assembler_.scan_id(), epoch_);
    }
    const bool rescaled = epoch_ != 0 && scale_.unsuitable(fitting_scale());
    if ((epoch_ == 0 || lost || rescaled) && !source_.empty()) {
      seed(cycle, expected.at_reference.T_rolling_vehicle);
    } else {
      register_scan(cycle, expected);
    }
  }
  assembler_.release();
  cycle.stages->mark("publish");
  cycle.stages->close_account();
}

// From facts of the timeline, before any of the work: with a stopwatch, a replay would not be
// deterministic.
void SpNode::choose_level(const Cycle& cycle) {
  // The facets before the last may have waited long; the time of the scan begins with its last.
  const Stamp deadline = std::max(cycle.deadline, last_facet_arrival_ + config_.info.budget);
  Cycle scan = cycle;
  scan.deadline = deadline;
  granted_ = grant(scan, config_.grant);

  ScanFacts facts;
  facts.budget = config_.info.budget;
  facts.late = late_;
  facts.left = deadline - cycle.now;
  facts.behind = static_cast<double>(ranges_.size() + facets_.size()) / facet_count_;
  if (full_need_ > 0) {
    facts.grant_share = static_cast<double>(granted_) / static_cast<double>(full_need_);
  }
  late_ = Duration::zero();
  const Degrade before = ladder_.level;
  ladder_ = step(ladder_, facts, config_.degrade);
  if (ladder_.level == before) return;
  report_.publish(cycle.now, event::kSpDegrade,
                  "level {} -> {}: {}; cycle start up to {:.1f} ms late, {:.1f} ms to the "
                  "deadline, {:.2f} scans waiting{}",
                  static_cast<int>(before), static_cast<int>(ladder_.level),
                  name_of(cause_of(facts, config_.degrade)), milliseconds(facts.late),
                  milliseconds(facts.left), facts.behind,
                  full_need_ > 0 ? fmt::format(", {:.0f} % of the nominal work granted",
                                               100.0 * facts.grant_share)
                                 : std::string());
}

/// @param measured  reference instant of the scan as its facets state it
void SpNode::begin_answer(const Cycle& cycle, Stamp measured) {
  ++account_.answered;
  account_.facets_lost += assembler_.facets_missing();
  if (ladder_.level == Degrade::kHold) {
    ++account_.held;
  } else if (ladder_.level != Degrade::kFull) {
    ++account_.degraded;
  }
  registration_t& m = registration_message_;
  m.utime = to_utime(assembler_.scan()->reference);
  m.scan_id = assembler_.scan_id();
  m.facets_lost = static_cast<std::int16_t>(assembler_.facets_missing());
  m.degrade_level = static_cast<std::int8_t>(ladder_.level);
  m.latency_trace = {};
  m.latency_trace.measured_utime = to_utime(measured);
  m.latency_trace.first_facet_utime = to_utime(first_facet_arrival_);
  m.latency_trace.last_facet_utime = to_utime(last_facet_arrival_);
  m.latency_trace.sp_start_utime = to_utime(cycle.now);
}

void SpNode::answer(const registration::Registration& registration, int target) {
  fill(registration, target, &registration_message_);
  registration_message_.map_epoch = epoch_;
  registration_message_.account = account_;
}

void SpNode::answer_without_registering(registration::Stop stop, const Expectation& expected) {
  registration::Registration none;
  none.stop = stop;
  none.T_target_vehicle = expected.at_reference.T_rolling_vehicle;
  answer(none, registration_t::TARGET_ROLLING);
  registration_out_.publish(&registration_message_);
}

namespace {

Result<std::unique_ptr<Node>> make_node(const ParamFile& file, Bus* bus, bool live) {
  const Result<SpConfig> config = load_sp_config(file);
  if (!config) return config.error();
  Result<PriorTerrain> prior = open_prior_terrain(config->prior_terrain, live);
  if (!prior) return prior.error();
  return std::unique_ptr<Node>(std::make_unique<SpNode>(*config, std::move(prior).value(), bus));
}

}  // namespace

Result<std::unique_ptr<Node>> make_sp_node(const ParamFile& file, Bus* bus) {
  return make_node(file, bus, false);
}

Result<std::unique_ptr<Node>> make_live_sp_node(const ParamFile& file, Bus* bus) {
  return make_node(file, bus, true);
}

}  // namespace rcs::sp
