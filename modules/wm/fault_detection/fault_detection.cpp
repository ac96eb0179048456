// Moves the sub-filters. The decisions about a source are in the file of its name.
#include "modules/wm/fault_detection/fault_detection.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/wm/fault_detection/filter_difference.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

constexpr Duration kFed = from_seconds(1.0);  // newest scan or fix of a filter without INS
constexpr Duration kBetweenScans = from_milliseconds(300.0);
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

/// A ratio between kCalm and the limit keeps the sub-filters that raised it, for a limited time:
/// the older they are, the less certain they are, and the more does an exclusion cost that
/// continues from one of them.
bool FaultDetection::tests_are_calm(Stamp branch, const FilterState& belief) const {
  const Stamp now = belief.belief.x.stamp;
  // Of a GPS that is excluded for good the fixes contradict the filter, and say nothing about the
  // other sources.
  const bool decided =
      belief.bookkeeping.gps_suspected && gps_suspect_ == Stamp::min() && !keeps_gps_.alive();
  const double gps = decided ? 0.0 : gps_test_ratio_;
  const Duration age = branch == Stamp::min() ? Duration::zero() : now - branch;
  const bool uncertain = age > 2 * params_.branch;
  const double limit = age > 4 * params_.branch ? 1.0 : uncertain ? kCalmLater : kCalm;
  // A tilted mount moves the height slowly, and the biases of the INS follow it.
  constexpr double kHeightWeight = 5.0;
  const double worst = std::max({gps, ladar_test_ratio_, kHeightWeight * ladar_height_ratio_,
                                 map_test_ratio_, ins_by_gps_.ratio, ins_by_constraint_.ratio});
  const double ins = ladar_is_poor() ? ins_test_ratio() : ins_by_ladar_.ratio;
  return worst <= limit && ins <= (uncertain ? kContradicts : kInsCalm);
}

/// From GPS or the a priori map. Without it a sub-filter keeps its own, which is older.
bool FaultDetection::has_position(const FilterState& belief) {
  const Bookkeeping& m = belief.bookkeeping;
  const Stamp placed =
      std::max(m.of(Source::kGpsPosition).accepted, m.of(Source::kPriorMap).accepted);
  const bool without = !m.georeferenced;  // no GPS to exclude
  return without || placed > belief.belief.x.stamp - kFresh;
}

/// A sub-filter needs the heading, and with an INS roll and pitch: a tilt of a degree lets gravity
/// move it by metres before the tilt is separated from a bias. The heading of a vehicle that stands
/// does not improve, and with old sub-filters its protection level may not let it drive.
bool FaultDetection::knows_attitude(const FilterState& belief) const {
  constexpr double kHeadingAtRest_rad = 0.02;
  constexpr Duration kRest = from_seconds(1.0);  // since the last zero-velocity update
  if (!belief.bookkeeping.georeferenced) return true;
  const Vec3 variance = belief.belief.P.diagonal().segment<3>(kAttitude);
  const auto known = [](double variance_rad2, double limit_rad) {
    return variance_rad2 <= limit_rad * limit_rad;
  };
  const double limit = params_.attitude_sigma_rad;
  const Stamp rest = belief.bookkeeping.of(Source::kZeroVelocity).accepted;
  const bool stands = rest != Stamp::min() && belief.belief.x.stamp - rest < kRest;
  return known(variance.z(), stands ? std::max(limit, kHeadingAtRest_rad) : limit) &&
         (!uses_forces(belief) || known(variance.head<2>().maxCoeff(), limit));
}

void FaultDetection::branch_inertial(const FilterState& belief, Inertial* inertial) const {
  *inertial = {};
  if (belief.bookkeeping.excluded.any_of_ins()) return;
  inertial->subfilter = {belief, belief.belief.x.stamp};
  inertial->subfilter.state.bookkeeping.excluded = {false, true, true, true};
  inertial->began_m = belief.bookkeeping.distance_m;
}

void FaultDetection::branch_recent(const FilterState& belief) {
  branch_inertial(belief, &inertial_new_);
  auto& [newest, second, third] = without_ins_recent_;
  third = second;
  second = newest;
  newest = {};
  if (belief.bookkeeping.excluded.ins) return;
  newest = {belief, belief.belief.x.stamp};
  newest.state.bookkeeping.excluded.ins = true;
}

void FaultDetection::branch_motion(const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  branched_ = true;
  untested_since_ = Stamp::max();
  inertial_ = inertial_young_;
  without_ins_ = without_ins_young_;
  without_ladar_ = without_ladar_young_;
  branch_inertial(belief, &inertial_young_);
  branch_recent(belief);
  without_ins_young_ = {};
  if (!belief.bookkeeping.excluded.ins) {
    without_ins_young_ = {belief, now};
    without_ins_young_.state.bookkeeping.excluded.ins = true;
  }
  without_ladar_young_ = {belief, now};
  without_ladar_young_.state.bookkeeping.excluded.ladar = true;
}

void FaultDetection::branch_without_gps(const FilterState& belief) {
  without_gps_ = without_gps_young_;
  neither_ = neither_young_;
  without_gps_began_m_ = young_began_m_;
  without_gps_young_ = {belief, belief.belief.x.stamp};
  without_gps_young_.state.bookkeeping.excluded.gps = true;
  without_gps_young_.state.bookkeeping.excluded.prior_map = true;
  neither_young_ = {};
  if (!belief.bookkeeping.excluded.ins) {
    neither_young_ = without_gps_young_;
    neither_young_.state.bookkeeping.excluded.ins = true;
  }
  young_began_m_ = belief.bookkeeping.distance_m;
  cusum_.setZero();
}

/// Twice: the older generation equals the younger one.
void FaultDetection::branch_all(const FilterState& belief) {
  for (int generation = 0; generation < 2; ++generation) {
    branch_motion(belief);
    branch_without_gps(belief);
  }
}

/// Branches sub-filters whose time has come, while the tests are calm. While the position is known
/// all branch together, because the decision between GPS and another source compares motions that
/// contain no fix since the same time. Without a position INS and LADAR are still compared.
void FaultDetection::renew(const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  const Bookkeeping& m = belief.bookkeeping;
  const auto due = [now](const Subfilter& youngest, Duration age) {
    return !youngest.alive() || now - youngest.branch >= age;
  };
  if (m.excluded.ladar) return;
  const bool settled = gps_fused_from_ == Stamp::min() || now - gps_fused_from_ >= kFixesSettle;
  const bool positioned = !m.excluded.gps && has_position(belief) && settled;
  const bool inertial_due =
      inertial_new_.subfilter.alive() && due(inertial_new_.subfilter, kNewInertial);
  const bool all_due = due(without_ladar_young_, params_.branch) ||
                       (positioned && due(without_gps_young_, params_.branch));
  if (!inertial_due && !all_due) return;
  if (!tests_are_calm(positioned ? without_gps_.branch : without_ladar_.branch, belief)) return;
  if (inertial_due) branch_recent(belief);
  // Until the gap of the INS is forgotten, a branch would inherit its effect on the filter.
  const bool settling = m.ins_gap_end != Stamp::min() && now - m.ins_gap_end < kSettling;
  if (!all_due || settling) return;
  if (!knows_attitude(belief)) {
    // Nor is an old sub-filter without GPS of use: its test starts again.
    if (positioned) {
      without_gps_young_ = without_gps_ = neither_young_ = neither_ = Subfilter{};
      detectable_m_ = kAnything_m;
    }
    return;
  }
  const bool first_motion = !without_ladar_young_.alive();
  branch_motion(belief);
  if (first_motion) branch_motion(belief);
  if (!positioned) return;
  const bool first = !without_gps_young_.alive();
  branch_without_gps(belief);
  if (first) branch_without_gps(belief);
}

UndetectedError UndetectedError::at(Stamp later) const {
  constexpr double kAccelerating = 1.5;
  if (stamp == Stamp::min()) return *this;
  const double t_s = kAccelerating * seconds(later - stamp);
  UndetectedError out = *this;
  out.stamp = later;
  out.horizontal_m += t_s * horizontal_mps;
  out.vertical_m += t_s * vertical_mps;
  return out;
}

UndetectedError UndetectedError::larger(const UndetectedError& other) const {
  return {std::max(stamp, other.stamp), std::max(horizontal_m, other.horizontal_m),
          std::max(vertical_m, other.vertical_m), std::max(horizontal_mps, other.horizontal_mps),
          std::max(vertical_mps, other.vertical_mps)};
}

/// A sub-filter without INS that receives neither scans nor fixes extrapolates: it bounds nothing.
/// Between scans that it accepts it does so, too, and its velocity is then wrong by metres per
/// second where the ground is broken: the bound of the newest one that it accepted counts. A
/// single wrong registration that it accepts gives such a velocity for one scan.
void FaultDetection::bound_undetected(const FilterState& belief) {
  for (const auto& [without, bound] : {std::pair{&without_ins_, &bound_without_ins_},
                                       std::pair{&without_ladar_, &bound_without_ladar_}}) {
    const Belief& b = without->state.belief;
    const Stamp now = b.x.stamp;
    if (!without->alive() || now - without->branch < kYoung) {
      *bound = {};
      continue;
    }
    if (!uses_forces(without->state)) {
      const Bookkeeping& m = without->state.bookkeeping;
      const Stamp scan = m.of(Source::kRolling).accepted;
      const Stamp fix = m.of(Source::kGpsPosition).accepted;
      const bool stale = bound->error.stamp < now - kFed;  // a fix without height, say
      if (stale || std::max(scan, fix) < now - kFed) *bound = {};
      const bool by_fix = fix == now && m.heights_refused == 0 && scan < now - kBetweenScans;
      if (scan != now && !by_fix) continue;
    }
    const Vec3 apart_m = b.x.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p;
    const Vec3 apart_mps = b.x.v_world - belief.belief.x.v_world;
    const double sigma_m = std::sqrt(largest_variance(horizontal(without->state)));
    const double sigma_mps = std::sqrt(largest_variance(b.P.block<2, 2>(kVelocity, kVelocity)));
    const double sigma_up_m = std::sqrt(b.P(kPosition + 2, kPosition + 2));
    const double sigma_up_mps = std::sqrt(b.P(kVelocity + 2, kVelocity + 2));
    const Vec2 rate_mps(std::max(0.0, apart_mps.head<2>().norm() - sigma_mps),
                        std::max(0.0, std::abs(apart_mps.z()) - sigma_up_mps));
    const Vec2 lasting_mps = rate_mps.cwiseMin(bound->rate_mps);
    bound->rate_mps = rate_mps;
    bound->error = {now, apart_m.head<2>().norm() + kHorizontalQuantile * sigma_m,
                    std::abs(apart_m.z()) + kVerticalQuantile * sigma_up_m, lasting_mps.x(),
                    lasting_mps.y()};
  }
}

namespace {

/// From the filter, plus the error of `other` (99.9 %).
UndetectedError distance_to(const FilterState& other, const FilterState& filter) {
  const Vec3 apart_m = other.belief.x.T_world_vehicle.p - filter.belief.x.T_world_vehicle.p;
  const double sigma_m = std::sqrt(largest_variance(horizontal(other)));
  const double sigma_up_m = std::sqrt(other.belief.P(kPosition + 2, kPosition + 2));
  UndetectedError out;
  out.stamp = filter.belief.x.stamp;
  out.horizontal_m = apart_m.head<2>().norm() + kHorizontalQuantile * sigma_m;
  out.vertical_m = std::abs(apart_m.z()) + kVerticalQuantile * sigma_up_m;
  return out;
}

}  // namespace

/// The distance to where GPS was excluded instead of the INS.
void FaultDetection::bound_keeping_gps(const FilterState& belief) {
  constexpr Duration kDecided = from_seconds(60.0);
  const FilterState& s = keeps_gps_.state;
  const Stamp now = belief.belief.x.stamp;
  if (keeps_gps_.alive() && now - keeps_gps_.began > kDecided) keeps_gps_ = {};
  bound_keeping_gps_ = keeps_gps_.alive() ? distance_to(s, belief) : UndetectedError{};
}

/// The distance to the motion that was given up for fixes that persisted: which of the two was
/// wrong nobody knows.
void FaultDetection::bound_given_up(const FilterState& belief) {
  constexpr Duration kDoubtful = from_seconds(60.0);
  const Stamp now = belief.belief.x.stamp;
  if (given_up_.alive() && now - given_up_.branch > kDoubtful) given_up_ = {};
  bound_given_up_ = given_up_.alive() ? distance_to(given_up_.state, belief) : UndetectedError{};
}

UndetectedError FaultDetection::undetected_by_tests(Stamp stamp) const {
  return bound_without_ins_.error.at(stamp)
      .larger(bound_without_ladar_.error.at(stamp))
      .larger(bound_keeping_gps_);
}

UndetectedError FaultDetection::undetected(Stamp stamp) const {
  return undetected_by_tests(stamp).larger(bound_given_up_);
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
  const bool wrong = wheels_are_stuck(m) || wheels_are_refused(m, belief);
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
