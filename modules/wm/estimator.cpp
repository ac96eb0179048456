#include "modules/wm/estimator.h"

#include <algorithm>

namespace rcs::wm {
namespace {

constexpr std::size_t kMaxWaiting = 64;
constexpr Duration kBlind = from_seconds(1.5);

}  // namespace

/// After such a time without input, a turn may have ended anywhere: no Gaussian describes the pose.
/// The filter is georeferenced again, as at the start, from its old attitude; biases are kept.
void Estimator::forget_place(FilterState* state) const {
  Belief& b = state->belief;
  const Mat6 biases = b.P.block<6, 6>(kGyroBias, kGyroBias);
  const Mat3 mount = b.P.block<3, 3>(kMount, kMount);
  b.P = initial_belief(params_, b.x.stamp).P;
  b.P.block<6, 6>(kGyroBias, kGyroBias) = biases;
  b.P.block<3, 3>(kMount, kMount) = mount;
  b.x.map_epoch = -1;
  Bookkeeping& m = state->bookkeeping;
  m.georeferenced = m.excluded.gps = m.gps_suspected = false;
  m.fix_received = Stamp::min();
  m.uncorrected = Pose{};
}

Estimator::Estimator(const WmParams& params, const std::optional<Geodetic>& datum)
    : params_(params), history_(Model(params)), fault_detection_(params.fault_detection) {
  if (datum) datum_.emplace(*datum);
  waiting_.reserve(kMaxWaiting);
  innovations_.reserve(4 * static_cast<std::size_t>(params.history.capacity));
}

void Estimator::start(const Belief& belief, double gravity) {
  FilterState state;
  state.belief = belief;
  if (belief.x.inertial) {
    state.bookkeeping.ins_stamp = belief.x.stamp;
    state.bookkeeping.stillness = leveler_.stillness();
  }
  // The local frame starts at the vehicle, level: z is up once gravity is known.
  state.bookkeeping.T_path_vehicle = belief.x.T_world_vehicle;
  state.bookkeeping.T_local_vehicle = belief.x.T_world_vehicle;
  T_local_vehicle_ = belief.x.T_world_vehicle;
  history_.restart(state);
  const Earth earth = datum_ ? earth_at(datum_->datum()) : Earth{gravity, Vec3::Zero()};
  history_.amend(earth, [](FilterState*) {});
  started_ = true;
  local_stamp_ = belief.x.stamp;
}

Continuation Estimator::continuation() const {
  Continuation c;
  c.state = history_.head();
  c.T_local_vehicle = T_local_vehicle_;
  c.earth = history_.model().earth;
  c.has_datum = datum_.has_value();
  if (datum_) c.datum = datum_->datum();
  c.ins_clock_shift = clocks_.ins_shift();
  return c;
}

void Estimator::resume(const Continuation& from) {
  if (from.has_datum) datum_.emplace(from.datum);
  clocks_.resume(from.ins_clock_shift);
  restart(from.state);
  history_.amend(from.earth, [](FilterState*) {});
  T_local_vehicle_ = from.T_local_vehicle;
  newest_imu_ = from.state.belief.x.stamp;
  started_ = true;
}

Reason Estimator::add(const ImuSample& imu, Stamp arrival) {
  if (!started_ || arrival == Stamp::min()) return add_inertial(imu, arrival);
  const ClockWatch::Verdict verdict = clocks_.add(imu, arrival);
  if (verdict == ClockWatch::Verdict::kRepeated) return Reason::kRepeated;
  if (verdict == ClockWatch::Verdict::kHeld) return Reason::kAccepted;
  const Reason held = clocks_.take_dropped() ? Reason::kInvalid : add_held();
  const Reason own = add_inertial(imu, arrival);
  return own == Reason::kAccepted ? held : own;
}

Reason Estimator::add_inertial(ImuSample imu, Stamp arrival) {
  if (started_) {
    imu.stamp += clocks_.ins_shift();
    const Stamp begin = imu.stamp - imu.interval;
    // The others may have continued when the INS fell silent.
    const Stamp newest = std::max(newest_imu_, history_.head().belief.x.stamp);
    if (begin - newest > kBlind && begin - newest <= params_.history.jump) {
      fuse();
      if (begin - history_.head().belief.x.stamp > kBlind) begin_after_silence(begin);
    }
    // Samples of a stall of this process: T_local_vehicle() needs the states since the last fusion.
    if (imu.stamp - history_.head().belief.x.stamp > params_.history.lag / 2) fuse();
    newest_imu_ = std::max(newest_imu_, imu.stamp);
    return add(Measurement{imu.stamp, imu}, arrival);
  }
  if (imu.stamp <= newest_imu_) {
    // A single stamp from the future must not prevent the start for ever.
    if (++out_of_range_ < params_.history.clock_step_count) return Reason::kRepeated;
    leveler_ = {};
  }
  out_of_range_ = 0;
  newest_imu_ = imu.stamp;
  if (const std::optional<Belief> belief = leveler_.add(imu, params_)) {
    start(*belief, leveler_.gravity());
  }
  return Reason::kAccepted;
}

void Estimator::discard_ins(Stamp since, Stamp until) {
  const Duration shift = clocks_.ins_shift();
  if (started_) history_.discard_ins(since + shift, until + shift);
}

/// @return why the newest sample that was not accepted was rejected
Reason Estimator::add_held() {
  Reason refused = Reason::kAccepted;
  for (const ImuSample& held : clocks_.held()) {
    const Reason reason = add_inertial(held, Stamp::min());
    if (reason != Reason::kAccepted) refused = reason;
  }
  clocks_.clear_held();
  return refused;
}

void Estimator::watch_clocks(Stamp now) {
  const std::optional<ClockStep> step = clocks_.resolve(now);
  if (!step) return;
  if (step->of_all) move_clock(step->step);
  static_cast<void>(add_held());
}

Reason Estimator::add(Stamp stamp, const OdometrySample& odometry, Stamp arrival) {
  if (!clocks_.add(Clock::kOdometry, stamp, arrival)) return Reason::kInvalid;
  // Odometry is relative: it cannot start the filter.
  return started_ ? add(Measurement{stamp, odometry}, arrival) : Reason::kNoDatum;
}

Reason Estimator::add(Stamp stamp, const RollingMatch& match, Stamp arrival) {
  if (!clocks_.add(Clock::kLadar, stamp, arrival)) return Reason::kInvalid;
  if (before_silence_) place_in_rolling_map(stamp, match);
  return add(Measurement{stamp, match}, arrival);
}

Reason Estimator::add(Stamp stamp, const GeodeticFix& geodetic, Stamp arrival) {
  if (!clocks_.add(Clock::kGps, stamp, arrival)) return Reason::kInvalid;
  if (!datum_) datum_.emplace(geodetic.antenna);
  GpsFix fix = geodetic.fix;
  fix.p_world = datum_->to_world(geodetic.antenna);
  const Reason reason = add(Measurement{stamp, fix}, arrival);
  if (reason == Reason::kAccepted && started_ && !history_.head().bookkeeping.georeferenced &&
      waiting_.size() < kMaxWaiting) {
    waiting_.push_back({stamp, fix});
  }
  return reason;
}

Reason Estimator::add(Stamp stamp, const PriorMatch& match, Stamp arrival) {
  // Its clock has been monitored by the rolling match of the same scan.
  if (!started_ || history_.head().bookkeeping.georeferenced || !datum_) {
    return add(Measurement{stamp, match}, arrival);
  }
  const Duration ahead = stamp - history_.head().belief.x.stamp;
  if (ahead > params_.history.jump) return Reason::kInvalid;
  if (-ahead > params_.history.lag) return Reason::kLate;
  waiting_match_ = WaitingMatch{stamp, match};
  return Reason::kAccepted;
}

Reason Estimator::add(const Measurement& m, Stamp arrival) {
  if (!started_) {
    // While the INS is received, the start waits for the levelling; without INS, this is the start.
    const Duration jump = params_.history.jump;
    if (newest_imu_ != Stamp::min() && m.stamp - newest_imu_ < jump &&
        newest_imu_ - m.stamp < jump) {
      return Reason::kNoDatum;
    }
    start(initial_belief(params_, m.stamp), Earth{}.gravity);
  }
  const Reason reason = history_.insert(m);
  if (reason == Reason::kAccepted || reason == Reason::kRepeated) {
    out_of_range_ = 0;
    in_range_arrival_ = std::max(in_range_arrival_, arrival);
    return reason;
  }
  // After a stall of this process one source is read before the others: what has waited meanwhile
  // is late, and no clock has stepped.
  if (arrival != Stamp::min() && arrival <= in_range_arrival_) return reason;
  // What was measured during a silence of this process may still wait in its queues.
  if (reason == Reason::kLate && silence_began_ < m.stamp && m.stamp < silence_ended_) {
    return reason;
  }
  if (out_of_range_ == 0) first_out_of_range_ = m.stamp;
  if (++out_of_range_ < params_.history.clock_step_count) return reason;
  step_clock(m.stamp);
  return history_.insert(m);
}

/// All clocks have stepped and no time has passed: the state continues at its new stamp.
void Estimator::move_clock(Duration step) {
  fuse();
  FilterState state = history_.head();
  Bookkeeping& m = state.bookkeeping;
  const auto move = [step](Stamp* stamp) {
    if (*stamp != Stamp::min()) *stamp += step;
  };
  for (SourceRecord& record : m.sources) move(&record.accepted);
  if (m.gps_scale.finer_since != Stamp::max()) m.gps_scale.finer_since += step;
  for (Stamp* stamp :
       {&state.belief.x.stamp, &m.gps_scale.renewed, &m.ins_stamp, &m.ins_lost, &m.ins_gap_end,
        &m.odometry_received, &m.constrained, &m.fix_received, &m.last_reset, &newest_imu_}) {
    move(stamp);
  }
  m.rejected_matches = {};
  restart(state);
  ++clock_steps_;
}

/// No source was in range for long: either the clocks have stepped or no input was received; stamps
/// alone cannot distinguish the two. Forward, the time is assumed to have passed, so that the
/// covariance is consistent in both cases; backward, only the time that the stamps of the rejected
/// inputs span.
void Estimator::step_clock(Stamp to) {
  constexpr Duration kLongest = std::chrono::seconds(60);
  const Duration refused = to - first_out_of_range_;
  fuse();
  FilterState state = history_.head();
  Bookkeeping& m = state.bookkeeping;
  const Duration forward = to - state.belief.x.stamp;
  const Duration passed =
      std::clamp(forward > Duration::zero() ? forward : refused, Duration::zero(), kLongest);
  const Duration step = forward - passed;
  state.belief.x.stamp += step;
  for (SourceRecord& record : m.sources) {
    if (record.accepted != Stamp::min()) record.accepted += step;
  }
  if (m.last_reset != Stamp::min()) m.last_reset += step;
  if (m.fix_received != Stamp::min()) m.fix_received += step;
  m.ins_stamp = m.ins_lost = m.ins_gap_end = m.odometry_received = m.constrained = Stamp::min();
  m.rejected_matches = {};
  Innovations none;
  if (passed > kBlind) {
    if (stands_in_map(state.belief)) {
      forget_all_but_map(to, &state);
    } else {
      forget_place(&state);
    }
    state.belief.x.stamp = to;
  } else {
    advance(history_.model(), to, nullptr, &state, &none);
  }
  restart(state);
  newest_imu_ = Stamp::min();
  ++clock_steps_;
}

/// All inputs were silent until `to`, for too long to predict any motion.
void Estimator::begin_after_silence(Stamp to) {
  FilterState state = history_.head();
  silence_began_ = state.belief.x.stamp;
  silence_ended_ = to;
  if (stands_in_map(state.belief)) {
    forget_all_but_map(to, &state);
    restart(state);
    return;
  }
  if (state.belief.x.map_epoch >= 0) {
    before_silence_ = BeforeSilence{state, T_local_vehicle_, to};
  } else {
    ++local_breaks_;
  }
  forget_place(&state);
  state.belief.x.stamp = to;
  Bookkeeping& m = state.bookkeeping;
  m.ins_stamp = m.ins_gap_end = to;
  m.odometry_received = m.constrained = Stamp::min();
  restart(state);
}

/// A vehicle that stood when all inputs fell silent is looked for where it stood.
bool Estimator::stands_in_map(const Belief& b) { return at_rest(b) && b.x.map_epoch >= 0; }

/// What the vehicle did meanwhile is unknown; the map did not move. The match that is fused next
/// ties the pose to it.
void Estimator::forget_all_but_map(Stamp to, FilterState* state) {
  constexpr double kSigma_m = 30.0, kSigma_rad = 1.0, kSigma_mps = 5.0, kSigma_radps = 1.0;
  NavState& x = state->belief.x;
  x.v_world = x.rate_vehicle = Vec3::Zero();
  x.stamp = to;
  Cov& P = state->belief.P;
  const auto forget = [&P](int first, double sigma) {
    P.middleRows<3>(first).setZero();
    P.middleCols<3>(first).setZero();
    P.diagonal().segment<3>(first).setConstant(sigma * sigma);
  };
  forget(kPosition, kSigma_m);
  forget(kAttitude, kSigma_rad);
  forget(kVelocity, kSigma_mps);
  forget(kRate, kSigma_radps);
  Bookkeeping& m = state->bookkeeping;
  m.uncorrected = Pose{};
  m.rejected_matches = {};
  m.ins_stamp = m.ins_gap_end = to;
  m.odometry_received = m.constrained = Stamp::min();
}

/// This process was silent, not the sensors: SP has tracked the vehicle in its rolling map
/// meanwhile. The pose follows from the match, with the covariance of the map.
void Estimator::place_in_rolling_map(Stamp stamp, const RollingMatch& match) {
  constexpr double kTracked_hz = 4.0;  // registrations that SP published meanwhile
  before_silence_->registrations += match.missed + 1;
  if (stamp < before_silence_->end) return;  // received late, from before or within the silence
  const BeforeSilence before = *before_silence_;
  before_silence_.reset();
  FilterState state = before.state;
  NavState& x = state.belief.x;
  const double silence_s = seconds(stamp - x.stamp);
  if (match.map_epoch != x.map_epoch || match.seeded ||
      static_cast<double>(before.registrations) < kTracked_hz * silence_s ||
      stamp < history_.head().belief.x.stamp - params_.history.lag) {
    ++local_breaks_;
    return;
  }
  const Pose T_vehicle_seen{exp_so3(x.mount), Vec3::Zero()};
  const Pose here = x.T_world_rolling * match.T_rolling_vehicle * T_vehicle_seen.inverse();
  const Pose step = x.T_world_vehicle.inverse() * here;
  x.T_world_vehicle = here;
  forget_all_but_map(stamp, &state);
  Bookkeeping& m = state.bookkeeping;
  m.T_path_vehicle = m.T_path_vehicle * step;
  m.T_local_vehicle = m.T_local_vehicle * step;
  m.distance_m += step.p.norm();
  restart(state);
  T_local_vehicle_ = before.T_local_vehicle * step;
}

void Estimator::restart(const FilterState& state) {
  history_.restart(state);
  fault_detection_.clear();
  local_stamp_ = state.belief.x.stamp;
  waiting_.clear();
  waiting_match_.reset();
  heading_.clear();
  loss_.clear();
  out_of_range_ = 0;
}

void Estimator::fuse() {
  if (!started_) return;
  history_.fuse(&innovations_);
  if (!history_.head().bookkeeping.georeferenced) find_place();
  if (!history_.head().bookkeeping.georeferenced) find_heading();
  finish();
  move_local();
  watch_loss();
}

void Estimator::watch_loss() {
  const NavState& x = history_.head().belief.x;
  const Vec3 v_vehicle = x.T_world_vehicle.q.conjugate() * x.v_world;
  if (!loss_.add(x.stamp, v_vehicle, params_.odometry.constrained)) return;
  FilterState state = history_.head();
  begin_again(params_, &state);
  restart(state);
  ++losses_;
}

void Estimator::finish() {
  const auto judge = [this](const Measurement& m, const ImuSample* next_imu,
                            const FilterState& belief) {
    std::optional<FilterState> change = fault_detection_.add(history_.model(), m, next_imu, belief);
    if (std::holds_alternative<RollingMatch>(m.value)) {
      history_.add_ladar_scale(m.stamp, fault_detection_.ladar_scale());
    }
    return change;
  };
  while (history_.finish(judge)) history_.fuse(&innovations_);
}

void Estimator::move_local() {
  const FilterState& head = history_.head();
  // Without an INS a scan is often received after a fix of its instant has advanced the belief: the
  // slewing allowed for that interval is kept for it.
  if (const Duration dt = head.belief.x.stamp - local_stamp_; dt > Duration::zero()) {
    const Bookkeeping& then = history_.at(local_stamp_).bookkeeping;
    T_local_vehicle_ =
        T_local_vehicle_ * (then.T_path_vehicle.inverse() * head.bookkeeping.T_path_vehicle);
    local_stamp_ = head.belief.x.stamp;
    slew_s_ = seconds(dt);
  }
  const Vec6 owed = log_se3(T_local_vehicle_.inverse() * head.bookkeeping.T_local_vehicle);
  const double needed_s = std::max(owed.head<3>().norm() / params_.local.slew_mps,
                                   owed.tail<3>().norm() / params_.local.slew_radps);
  if (needed_s <= 0.0) return;
  const double share = std::min(1.0, slew_s_ / needed_s);
  T_local_vehicle_ = T_local_vehicle_ * exp_se3(share * owed);
  slew_s_ -= share * needed_s;
}

/// The fixes of the newest second wait in the history; once the heading is known, the oldest state
/// is georeferenced and they are fused as usual.
void Estimator::find_heading() {
  std::size_t used = 0;
  for (; used < waiting_.size(); ++used) {
    const WaitingFix& w = waiting_[used];
    if (w.stamp > history_.head().belief.x.stamp) break;
    const std::optional<Georeference> found =
        heading_.add(w.stamp, w.fix, history_.at(w.stamp), params_);
    if (!found) continue;
    history_.amend(earth_at(datum_->datum()),
                   [&found](FilterState* oldest) { georeference(*found, oldest); });
    fault_detection_.clear();
    fault_detection_.begin_fixes(w.stamp);
    history_.fuse(&innovations_);
    waiting_.clear();
    heading_.clear();
    return;
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(used));
}

/// Initial localization of SP was successful: the oldest state is georeferenced from the newest.
void Estimator::find_place() {
  if (!waiting_match_ || waiting_match_->stamp > history_.head().belief.x.stamp) return;
  const WaitingMatch w = *waiting_match_;
  waiting_match_.reset();
  const std::optional<Georeference> found =
      georeference_by_map(w.match, history_.at(w.stamp).belief.x, params_.align);
  if (!found) return;
  const MapBias bias = modelled_bias(w.match.bias, params_);
  history_.amend(earth_at(datum_->datum()), [&found, &bias](FilterState* oldest) {
    georeference_on_map(*found, bias, oldest);
  });
  fault_detection_.clear();
  history_.fuse(&innovations_);
  waiting_.clear();
  heading_.clear();
}

Mode Estimator::mode() const {
  return started_ ? wm::mode(history_.head(), params_) : Mode::kAlign;
}

}  // namespace rcs::wm
