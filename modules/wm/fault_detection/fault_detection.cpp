// Moves the sub-filters, and replaces the filter after a finding. The decisions about a source are
// in the file of its name.
#include "modules/wm/fault_detection/fault_detection.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/wm/fault_detection/filter_difference.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

constexpr int kRefusedInRow = 3;  // rejected measurements that end a hypothesis

/// A measurement of an excluded source, one without a datum, of another map or without an observed
/// direction neither agrees nor contradicts.
bool was_compared(Reason reason) {
  return reason != Reason::kQuarantine && reason != Reason::kNoDatum && reason != Reason::kEpoch &&
         reason != Reason::kUnobserved;
}

/// The filter without INS is not moved to each of its samples.
void step(const Model& model, const Measurement& m, const ImuSample* next_imu, FilterState* s,
          Innovations* records) {
  constexpr Duration kStep = from_milliseconds(50.0);
  if (s->bookkeeping.excluded.ins && m.imu() != nullptr && m.stamp - s->belief.x.stamp < kStep) {
    return;
  }
  advance(model, m.stamp, next_imu, s, records);
  apply(model, m, s, records);
}

}  // namespace

FaultDetection::FaultDetection(const FaultDetectionParams& params)
    : params_(params),
      monitors_(params.probation),
      limit_1_(chi_square_gate(1, params.false_alarm)),
      limit_2_(chi_square_gate(2, params.false_alarm)),
      limit_3_(chi_square_gate(3, params.false_alarm)) {}

void FaultDetection::clear() {
  FaultDetection cleared(params_);
  // It may not have been reported yet.
  cleared.finding_ = finding_;
  cleared.findings_ = findings_;
  cleared.finding_ratio_ = finding_ratio_;
  cleared.finding_moved_m_ = finding_moved_m_;
  *this = cleared;
}

void FaultDetection::Hypothesis::count(bool accepted) {
  if (accepted) {
    ++agreed;
    refused_in_row = 0;
  } else {
    ++refused;
    if (++refused_in_row >= kRefusedInRow) began = Stamp::min();
  }
}

void FaultDetection::move(const Model& model, const Measurement& m, const ImuSample* next_imu,
                          const FilterState& belief) {
  const bool match = std::holds_alternative<RollingMatch>(m.value);
  // Not where it has moved the map instead, because the matches contradict it.
  const Bookkeeping& of_filter = belief.bookkeeping;
  const bool confirmed = match && !of_filter.excluded.ins &&
                         of_filter.of(Source::kRolling).accepted == m.stamp &&
                         of_filter.rejected_matches.reset < m.stamp - RejectedMatches::kResetLasts;
  auto& [newest, second, third] = without_ins_recent_;
  for (Subfilter* subfilter :
       {&inertial_new_.subfilter, &inertial_young_.subfilter, &inertial_.subfilter, &newest,
        &second, &third, &without_ins_young_, &without_ins_, &without_ladar_young_, &without_ladar_,
        &without_gps_young_, &without_gps_, &neither_young_, &neither_, &before_, &given_up_}) {
    if (!subfilter->alive()) continue;
    Innovations unread;
    // Where the vehicle pitches over an edge the constant rate is wrong. The match is then
    // rejected, and so would be the following ones, while the sub-filter diverges. The filter with
    // the INS accepts the match: it is not the registration that is wrong.
    constexpr double kRougher = 8.0;  // a pitch of 20 deg within 0.2 s
    const Stamp last = subfilter->state.bookkeeping.of(Source::kRolling).accepted;
    step(model, m, next_imu, &subfilter->state, &unread);
    const Bookkeeping& memory = subfilter->state.bookkeeping;
    if (confirmed && memory.excluded.ins && last != Stamp::min() &&
        memory.of(Source::kRolling).refused > 0) {
      Belief& b = subfilter->state.belief;
      b = widen(b, std::min(seconds(m.stamp - last), 1.0), model.params.motion, kRougher);
    }
  }
  const bool fix = std::holds_alternative<GpsFix>(m.value);
  const bool prior = std::holds_alternative<PriorMatch>(m.value);
  for (Hypothesis* hypothesis :
       {&gps_right_, &keeps_gps_, &ladar_right_, &ins_right_, &map_right_}) {
    if (!hypothesis->alive()) continue;
    Innovations records;
    step(model, m, next_imu, &hypothesis->state, &records);
    const bool concerns = hypothesis == &ins_right_     ? fix || match
                          : hypothesis == &ladar_right_ ? match
                          : hypothesis == &map_right_   ? prior
                                                        : fix;
    const Source source = fix ? Source::kGpsPosition : prior ? Source::kPriorMap : Source::kRolling;
    const bool velocities = hypothesis == &keeps_gps_;
    for (int k = 0; concerns && k < records.count; ++k) {
      const Innovation& record = records.records[static_cast<std::size_t>(k)];
      if (record.source == source || (velocities && record.source == Source::kGpsVelocity)) {
        if (was_compared(record.reason)) hypothesis->count(record.reason == Reason::kAccepted);
      }
    }
  }
}

void FaultDetection::drop_what_passed_a_gap(Stamp now) {
  bool dropped = false;
  for (Subfilter* subfilter :
       {&inertial_new_.subfilter, &inertial_young_.subfilter, &inertial_.subfilter,
        &without_ladar_young_, &without_ladar_, &without_gps_young_, &without_gps_, &before_}) {
    if (!subfilter->passed_gap()) continue;
    *subfilter = Subfilter{};
    dropped = true;
  }
  for (Hypothesis* hypothesis : {&gps_right_, &ladar_right_, &ins_right_, &map_right_}) {
    const Bookkeeping& m = hypothesis->state.bookkeeping;
    if (m.excluded.ins) continue;
    if (hypothesis->alive() && std::max(m.ins_lost, m.ins_gap_end) >= hypothesis->began) {
      *hypothesis = Hypothesis{};
    }
  }
  if (!dropped) return;
  if (untested_since_ == Stamp::max()) untested_since_ = now;
  gps_test_ratio_ = ladar_test_ratio_ = map_test_ratio_ = map_alternative_m_ = 0.0;
  ladar_height_ratio_ = 0.0;
  suspicious_fixes_ = map_contradicted_ = 0;
  gps_contradicts_ = Stamp::max();
  cusum_.setZero();
  ladar_suspected_since_ = map_suspected_since_ = Stamp::min();
  ins_by_ladar_ = ins_by_gps_ = ins_by_constraint_ = ins_rises_ = {};
  detectable_m_ = kAnything_m;
}

std::optional<FilterState> FaultDetection::add(const Model& model, const Measurement& m,
                                               const ImuSample* next_imu,
                                               const FilterState& belief) {
  auto& [newest, second, third] = without_ins_recent_;
  for (Subfilter* subfilter : {&without_ladar_, &without_ladar_young_, &without_ins_,
                               &without_ins_young_, &newest, &second, &third}) {
    subfilter->state.bookkeeping.excluded.gps = belief.bookkeeping.excluded.gps;
  }
  move(model, m, next_imu, belief);
  drop_what_passed_a_gap(belief.belief.x.stamp);
  if (std::holds_alternative<RollingMatch>(m.value) || std::holds_alternative<GpsFix>(m.value)) {
    bound_undetected(belief);
    bound_keeping_gps(belief);
    bound_given_up(belief);
  }
  forget_silent(belief);
  std::optional<FilterState> change = judge(model, m, belief);
  step_monitors((change ? *change : belief).bookkeeping.excluded, belief.belief.x.stamp);
  return change;
}

std::optional<FilterState> FaultDetection::judge(const Model& model, const Measurement& m,
                                                 const FilterState& belief) {
  const bool stuck = wheels_are_stuck(m);
  const bool refused = wheels_are_refused(m, belief);
  if (refused && !stuck && only_filter_speed_changed(m, belief)) {
    return exclude_ins(belief, model.params.modes);
  }
  const bool wrong = stuck || refused;
  const bool outvoted = wheels_are_outvoted(m, belief);
  if (!belief.bookkeeping.excluded.wheels && outvoted) {
    return exclude_outvoted_odometry(belief, model.params.modes);
  }
  if (wrong && !belief.bookkeeping.excluded.wheels) {
    return exclude_odometry(belief, model.params.modes);
  }
  test_ins(model, m, belief);
  if (std::optional<FilterState> change = belief.bookkeeping.excluded.any_of_ins()
                                              ? decide_excluded_ins(m, belief, model.params.modes)
                                              : decide_ins(belief, model.params.modes)) {
    return change;
  }
  const bool suspected = belief.bookkeeping.gps_suspected && !gps_suspected_;
  gps_suspected_ = belief.bookkeeping.gps_suspected;
  // An error of GPS may have begun before the rejections: the sub-filter has none of these fixes.
  const auto* const fix = std::get_if<GpsFix>(&m.value);
  if (suspected && without_gps_.alive() && belief.belief.x.stamp - without_gps_.branch > kYoung) {
    gps_suspect_ = belief.belief.x.stamp;
    if (!keeps_gps_.alive()) suppose_ins_faulty(belief);
  } else if (suspected && fix != nullptr && ins_is_faulty_from_the_start(belief)) {
    return exclude_early_ins(model, belief);
  } else if (suspected && fix != nullptr) {
    finding_ = Finding::kGpsRejected;
    ++findings_;
    const Nis n = nis(belief, *fix, model.params.gps, 0.0);
    finding_ratio_ = std::max(n.horizontal / model.gates[2], n.vertical / model.gates[1]);
    finding_moved_m_ = 0.0;
  }
  // Without its sub-filter nothing replaces the filter.
  if (!belief.bookkeeping.gps_suspected || !without_gps_.alive()) gps_suspect_ = Stamp::min();
  if (fix != nullptr) {
    gps_judged_ = belief.belief.x.stamp;
    watch_jumps(model, *fix, gps_judged_);
  }
  if (gps_suspect_ != Stamp::min() && fix != nullptr) {
    return judge_suspect_fix(model, *fix, belief);
  }
  std::optional<FilterState> change;
  if (fix != nullptr && belief.bookkeeping.georeferenced) {
    change = belief.bookkeeping.excluded.gps ? judge_quarantined_fix(model, *fix, belief)
                                             : judge_fix(model, *fix, belief);
  } else if (std::holds_alternative<PriorMatch>(m.value)) {
    change = belief.bookkeeping.excluded.prior_map ? judge_excluded_map(belief, model.params.modes)
                                                   : judge_prior_match(belief, model.params.modes);
  } else if (std::holds_alternative<RollingMatch>(m.value)) {
    change = belief.bookkeeping.excluded.ladar ? judge_quarantined_match(belief, model.params.modes)
                                               : judge_match(belief, model.params.modes);
  } else if (const auto* const wheels = std::get_if<OdometrySample>(&m.value)) {
    if (belief.bookkeeping.excluded.wheels) {
      change = judge_excluded_odometry(model, *wheels, belief);
    }
  }
  if (!change) renew(belief);
  return change;
}

/// The ratio of a source that has fallen silent says nothing any more.
void FaultDetection::forget_silent(const FilterState& belief) {
  const Stamp fresh = belief.belief.x.stamp - kFresh;
  const Bookkeeping& m = belief.bookkeeping;
  if (!m.excluded.ladar && m.of(Source::kRolling).accepted < fresh) {
    ladar_test_ratio_ = ladar_height_ratio_ = 0.0;
    ladar_suspected_since_ = Stamp::min();
  }
  if (!m.excluded.gps && gps_judged_ < fresh) {
    gps_test_ratio_ = 0.0;
    gps_contradicts_ = Stamp::max();
    suspicious_fixes_ = 0;
  }
}

void FaultDetection::step_monitors(const Excluded& excluded, Stamp now) {
  const auto agrees = [](const Hypothesis& right) {
    return right.alive() && right.agreed > 0 && right.refused_in_row == 0;
  };
  const bool gps_agrees = agreeing_since_ != Stamp::min();
  monitors_.gps.step(excluded.gps, gps_test_ratio_ > 1.0, gps_agrees, now);
  monitors_.ladar.step(excluded.ladar, ladar_test_ratio_ > 1.0, agrees(ladar_right_), now);
  monitors_.ins.step(excluded.any_of_ins(), ins_test_ratio() > 1.0, agrees(ins_right_), now);
  // No test concerns the wheels alone.
  monitors_.odometry.step(excluded.wheels, false, odometry_agrees_s_ > 0.0, now);
  monitors_.prior_map.step(excluded.prior_map, map_test_ratio_ > 1.0, agrees(map_right_), now);
}

namespace {

SourceStatus source_status(SourceState state) {
  switch (state) {
    case SourceState::kUsed:
      return SourceStatus::kFully;
    case SourceState::kSuspect:
      return SourceStatus::kSuspect;
    case SourceState::kExcluded:
      return SourceStatus::kQuarantine;
    case SourceState::kReadmitting:
      return SourceStatus::kReadmitting;
    case SourceState::kProbation:
      return SourceStatus::kProbation;
  }
  return SourceStatus::kNone;
}

/// @param excluded_now  by the newest filter: the monitor is late by the lag of the history
SourceStatus status(const SourceMonitor& monitor, bool excluded_now) {
  const SourceStatus late = source_status(monitor.state());
  if (excluded_now == excluded(late)) return late;
  return excluded_now ? SourceStatus::kQuarantine : SourceStatus::kFully;
}

}  // namespace

/// Continues with `next` in place of `belief`.
FilterState FaultDetection::found(Finding finding, const FilterState& next,
                                  const FilterState& belief, const ModeParams& modes) {
  finding_ = finding;
  ++findings_;
  finding_ratio_ = std::max({gps_test_ratio_, ladar_test_ratio_, map_test_ratio_,
                             ins_by_ladar_.ratio, ins_by_gps_.ratio, ins_by_constraint_.ratio});
  finding_moved_m_ =
      (next.belief.x.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p).head<2>().norm();
  const Stamp now = belief.belief.x.stamp;
  FilterState state = next;
  state.bookkeeping.world_resets = belief.bookkeeping.world_resets;
  state.bookkeeping.last_reset_m = belief.bookkeeping.last_reset_m;
  state.bookkeeping.last_reset_rad = belief.bookkeeping.last_reset_rad;
  state.bookkeeping.last_reset = belief.bookkeeping.last_reset;
  state.bookkeeping.fix_received = belief.bookkeeping.fix_received;
  count_reset(modes, belief.belief.x.T_world_vehicle, &state);
  if (finding == Finding::kLadarFaulty) monitors_.ladar.exclude(now);
  gps_suspect_ = Stamp::min();
  const bool of_ladar = finding == Finding::kLadarFaulty || finding == Finding::kLadarReadmitted;
  if (finding == Finding::kGpsReadmitted || finding == Finding::kFilterFaulty) {
    monitors_.gps.readmit(now);
  }
  if (finding == Finding::kLadarReadmitted) monitors_.ladar.readmit(now);
  if (finding == Finding::kMapFaulty) monitors_.prior_map.exclude(now);
  if (finding == Finding::kMapReadmitted) monitors_.prior_map.readmit(now);
  gps_right_ = keeps_gps_ = ladar_right_ = ins_right_ = map_right_ = {};
  bound_keeping_gps_ = {};
  // It uses the INS, and does not know which other source is wrong.
  if (finding != Finding::kGpsFaulty) {
    given_up_ = {};
    bound_given_up_ = {};
  }
  agree_with_given_up_ = 0;
  refused_ = {};
  turned_ = {};
  ins_by_ladar_ = ins_by_gps_ = ins_by_constraint_ = ins_rises_ = {};
  scan_ = {};
  votes_.reset_votes();
  wheels_vote_ = fix_vote_ = 0.0;
  speeds_ = {};
  off_by_ins_mps_ = off_by_ladar_mps_ = Vec2::Zero();
  agreeing_.fill(false);
  agreeing_since_ = ladar_suspected_since_ = map_suspected_since_ = Stamp::min();
  suspicious_fixes_ = map_contradicted_ = 0;
  gps_contradicts_ = Stamp::max();
  gps_test_ratio_ = ladar_test_ratio_ = map_test_ratio_ = alternative_m_ = map_alternative_m_ = 0.0;
  ladar_height_ratio_ = 0.0;
  detectable_m_ = kAnything_m;
  before_ = finding == Finding::kFilterFaulty ? Subfilter{belief, now} : Subfilter{};
  // Sub-filters that have fused a faulty source are discarded.
  const Inertial inertial = inertial_;
  without_ins_recent_ = {};
  branch_all(state);
  if (of_ladar && !state.bookkeeping.excluded.any_of_ins()) inertial_ = inertial;
  if (finding == Finding::kGpsReadmitted) {
    gps_fused_from_ = now;
    without_gps_ = without_gps_young_ = neither_ = neither_young_ = Subfilter{};
  }
  return state;
}

const Subfilter& FaultDetection::subfilter(Without what) const {
  if (what == Without::kAll) return inertial_.subfilter;
  return what == Without::kLadar ? without_ladar_ : without_gps_;
}

SourceStatus FaultDetection::gps(const FilterState& belief, const ModeParams& modes) const {
  const Bookkeeping& m = belief.bookkeeping;
  const Stamp now = belief.belief.x.stamp;
  if (m.fix_received == Stamp::min() || now - m.fix_received > modes.gps_timeout) {
    return SourceStatus::kNone;
  }
  return status(monitors_.gps, m.excluded.gps);
}

SourceStatus FaultDetection::ladar(const FilterState& belief, const ModeParams& modes) const {
  const Bookkeeping& m = belief.bookkeeping;
  const Stamp now = belief.belief.x.stamp;
  if (m.excluded.ladar) return status(monitors_.ladar, true);
  const Stamp match = m.of(Source::kRolling).accepted;
  if (match == Stamp::min() || now - match > modes.rolling_timeout) return SourceStatus::kNone;
  return status(monitors_.ladar, false);
}

SourceStatus FaultDetection::ins(const FilterState& belief) const {
  return status(monitors_.ins, belief.bookkeeping.excluded.any_of_ins());
}

}  // namespace rcs::wm
