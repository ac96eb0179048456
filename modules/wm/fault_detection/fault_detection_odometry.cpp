// Odometry: excluded if it is what contradicts two sources that agree, and its readmission. The
// innovation gate and the slip states take short errors.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/fault_detection.h"

namespace rcs::wm {
namespace {

// Difference from another speed at which wheels agree with it.
constexpr double kSame_mps = 0.1;
constexpr double kSameShare = 0.02;
constexpr double kMoves_mps = 1.5;  // a vehicle at rest tells nothing
constexpr double kLongest_s = 0.3;  // that a sample counts

// Wheels whose values repeat, against the LADAR alone.
constexpr Duration kCompared = from_seconds(1.0);
constexpr int kDiffering = 2;  // in a row: a single registration may be wrong, also at rest
constexpr double kStuck_mps = 0.3;
constexpr double kStuckShare = 0.05;

// Wheels that every filter rejects although its motion is confirmed.
constexpr double kRefused_s = 1.66;  // time constant of the share: 2 s if all are rejected
constexpr double kRefusedShare = 0.7;
constexpr Duration kGap = from_seconds(1.0);        // begins again after it
constexpr Duration kConfirmed = from_seconds(0.5);  // age of a match or fix
constexpr int kFollowing = 4;                       // of the constraint, accepted in a row

bool same(double a_mps, double b_mps) {
  return std::abs(a_mps - b_mps) < kSame_mps + kSameShare * std::abs(b_mps);
}

double speed_ahead(const NavState& x) { return (x.T_world_vehicle.q.conjugate() * x.v_world).x(); }

}  // namespace

/// The speed of the wheels, which this sub-filter uses, is not that by the INS alone.
bool FaultDetection::wheels_contradict_ins(const FilterState& others) const {
  if (!uses_wheels(others) || !inertial_.subfilter.alive()) return false;
  const NavState& ins = inertial_.subfilter.state.belief.x;
  const double ahead_mps = speed_ahead(ins);
  return !same(others.bookkeeping.odometry_mps, ahead_mps);
}

/// Of what contradicts the fixes, wheels are left: the INS supports the fixes, the LADAR does not
/// contradict the INS, and the wheels do.
bool FaultDetection::wheels_are_left(const Model& model, const GpsFix& z) const {
  const FilterState& others = without_gps_.state;
  if (!wheels_contradict_ins(others)) return false;
  const NavState& ins = inertial_.subfilter.state.belief.x;
  const double ahead_mps = speed_ahead(ins);
  // With a wrong heading the velocity by the INS is not along the vehicle: the speed is the same.
  const double wheels_mps = others.bookkeeping.odometry_mps;
  const auto as_fast_as = [&](double mps) {
    return std::abs(std::abs(wheels_mps) - mps) < 0.5 * std::abs(wheels_mps - ahead_mps);
  };
  const bool as_fast =
      as_fast_as(ins.v_world.norm()) || (z.has_velocity && as_fast_as(z.v_world.norm()));
  return !as_fast && ins_by_ladar_.ratio <= kCalm && !violates_constraint(kFollowsConstraint) &&
         (fix_vote_ < 0.0 || sides_with_fix(model, z, inertial_.subfilter));
}

/// The position by the INS alone is nearer to that of the filter, which is by the LADAR, than to
/// that of the sub-filter by INS and wheels.
bool FaultDetection::ins_sides_with_ladar(const FilterState& belief) const {
  const Subfilter& inertial = inertial_.subfilter;
  if (!inertial.alive() || ins_by_ladar_.ratio > kCalm) return false;
  const auto place = [](const FilterState& s) {
    return Vec2(s.belief.x.T_world_vehicle.p.head<2>());
  };
  // The uncertainty of the position at the branch is common to both.
  const Cov& P = inertial.state.belief.P;
  const double sigma_m = std::sqrt(P.diagonal().segment<2>(kPosition).maxCoeff()) -
                         std::sqrt(belief.belief.P.diagonal().segment<2>(kPosition).minCoeff());
  const double apart_m = (place(without_ladar_.state) - place(belief)).norm();
  return std::max(sigma_m, (place(inertial.state) - place(belief)).norm()) < 0.5 * apart_m;
}

/// Wheels that repeat their values to the last bit, although the LADAR alone measures another
/// speed, are stuck: no majority is needed, and with a faulty INS there is none.
bool FaultDetection::wheels_are_stuck(const Measurement& m) {
  if (const auto* const wheels = std::get_if<OdometrySample>(&m.value)) {
    const bool repeats =
        wheels->speed_mps == stuck_.speed_mps &&
        (wheels->yaw_rate_radps == stuck_.yaw_rate_radps || std::isnan(wheels->yaw_rate_radps));
    if (!repeats) stuck_.since = m.stamp;
    stuck_.speed_mps = wheels->speed_mps;
    stuck_.yaw_rate_radps = wheels->yaw_rate_radps;
    stuck_.received = m.stamp;
    return false;
  }
  const auto* const match = std::get_if<RollingMatch>(&m.value);
  if (match == nullptr) return false;
  const bool same_map = match->map_epoch == stuck_.map_epoch && stuck_.from < m.stamp;
  if (same_map && m.stamp - stuck_.from < kCompared) return false;
  const double ladar_mps = same_map ? (match->T_rolling_vehicle.p - stuck_.from_m).norm() /
                                          seconds(m.stamp - stuck_.from)
                                    : 0.0;
  const double off_mps = std::abs(ladar_mps - std::abs(stuck_.speed_mps));
  const bool differs =
      same_map && stuck_.received != Stamp::min() && stuck_.since <= stuck_.from &&
      m.stamp - stuck_.received < kFresh && m.stamp - stuck_.from < 2 * kCompared &&
      off_mps > kStuck_mps + kStuckShare * std::max(ladar_mps, std::abs(stuck_.speed_mps));
  stuck_.from = m.stamp;
  stuck_.from_m = match->T_rolling_vehicle.p;
  stuck_.map_epoch = match->map_epoch;
  stuck_.differing = differs ? stuck_.differing + 1 : 0;
  return stuck_.differing >= kDiffering;
}

/// The filter rejects the wheels while LADAR or GPS confirm its motion, and no other source is
/// suspect. Those samples of noisy wheels that it accepts move it all the same, and it would accept
/// all of them as soon as it is uncertain, after a short gap of the INS.
bool FaultDetection::wheels_are_refused(const Measurement& input, const FilterState& belief) {
  if (!std::holds_alternative<OdometrySample>(input.value)) return false;
  const Stamp now = belief.belief.x.stamp;
  const Bookkeeping& m = belief.bookkeeping;
  const Duration since = refused_.at == Stamp::min() ? Duration::max() : input.stamp - refused_.at;
  const bool again = since < Duration::zero() || since > kGap || m.excluded.wheels;
  const double rejected = m.of(Source::kOdometry).accepted == input.stamp ? 0.0 : 1.0;
  const double weight = again ? 0.0 : std::min(1.0, seconds(since) / kRefused_s);
  refused_.share = again ? 0.0 : refused_.share + weight * (rejected - refused_.share);
  refused_.at = input.stamp;
  if (rejected == 0.0 || again) {
    refused_.wheels_mps = std::get<OdometrySample>(input.value).speed_mps;
    refused_.ahead_mps = speed_ahead(belief.belief.x);
  }
  if (refused_.share < kRefusedShare) return false;
  const auto confirms = [&](Source source) {
    return m.of(source).refused == 0 && m.of(source).accepted > now - kConfirmed;
  };
  const bool suspect = std::max({gps_test_ratio_, ladar_test_ratio_, map_test_ratio_}) > kCalm ||
                       ins_by_ladar_.ratio > kInsCalm || violates_constraint(kSuspectAcross);
  const bool follows = m.of(Source::kNonHolonomic).in_row >= kFollowing;
  const bool observed = votes_.sigma_ahead_m() < kObserved_m && confirms(Source::kRolling);
  return uses_forces(belief) && follows && !suspect && m.odometry_received > now - kConfirmed &&
         (observed || confirms(Source::kGpsVelocity));
}

/// Since the filter has accepted a sample of the wheels, its own speed has changed, and that of the
/// wheels has not: wheels that slip or fail change theirs. A LADAR that observes no distance
/// follows the INS; fixes do not. Wheels that repeat their values may be stuck.
bool FaultDetection::only_filter_speed_changed(const Measurement& input,
                                               const FilterState& belief) const {
  constexpr double kMin_mps = 1.0;
  constexpr double kMax = 0.7;  // shares of the difference
  constexpr double kLittle = 0.3;
  constexpr Duration kRepeats = from_seconds(0.4);
  const Stamp now = belief.belief.x.stamp;
  const auto* const wheels = std::get_if<OdometrySample>(&input.value);
  const Bookkeeping& m = belief.bookkeeping;
  const Stamp fix =
      std::max(m.of(Source::kGpsVelocity).accepted, m.of(Source::kGpsPosition).accepted);
  if (wheels == nullptr || fix > now - kFresh || input.stamp - stuck_.since > kRepeats) {
    return false;
  }
  if (!without_ins_.alive() || now - without_ins_.branch < kYoung) return false;
  const double own_mps = speed_ahead(belief.belief.x);
  const double apart_mps = std::abs(own_mps - wheels->speed_mps);
  return apart_mps > kMin_mps && std::abs(own_mps - refused_.ahead_mps) > kMax * apart_mps &&
         std::abs(wheels->speed_mps - refused_.wheels_mps) < kLittle * apart_mps;
}

/// Without INS the yaw rate and the speed of the wheels move the filter, and a filter that is wrong
/// rejects the fixes.
bool FaultDetection::wheels_are_outvoted(const Measurement& m, const FilterState& belief) {
  WheelsVote& others = others_against_wheels_;
  const bool without_ins = belief.bookkeeping.excluded.any_of_ins() || !belief.belief.x.inertial;
  if (const auto* const wheels = std::get_if<OdometrySample>(&m.value)) {
    others.add(m.stamp, *wheels, belief.belief.x.wheel_scale);
  } else if (const auto* const fix = std::get_if<GpsFix>(&m.value)) {
    others.add(m.stamp, *fix);
  } else if (const auto* const match = std::get_if<RollingMatch>(&m.value)) {
    const bool turns = belief.bookkeeping.excluded.any_of_ins() && rotated_ > m.stamp - kFresh;
    others.add(m.stamp, *match, turns ? &rotation_ : nullptr);
  }
  if (!without_ins) others.begin();
  return without_ins && others.contradicts();
}

/// What they have done to the filter in the last seconds, if it has accepted them, is uncertain,
/// and fixes that it has rejected since are used again.
FilterState FaultDetection::exclude_outvoted_odometry(const FilterState& belief,
                                                      const ModeParams& modes) {
  FilterState loose = belief;
  if (belief.bookkeeping.of(Source::kOdometry).refused == 0) {
    const Motion& apart = others_against_wheels_.apart();
    const double m = std::abs(apart.distance_m);
    const double mps = m / seconds(WheelsVote::kWindow);
    loose.belief = loosen_world(belief.belief, Vec3(m, m, 0.0), apart.turn_rad);
    loose.belief.P.diagonal().segment<2>(kVelocity).array() += mps * mps;
  }
  const bool consequence =
      belief.bookkeeping.of(Source::kGpsPosition).accepted > belief.belief.x.stamp - kConsequence;
  if (others_against_wheels_.by_fixes() && belief.bookkeeping.gps_suspected && consequence) {
    loose.bookkeeping.excluded.gps = loose.bookkeeping.gps_suspected = false;
    loose.bookkeeping.of(Source::kGpsPosition).refused = 0;
  }
  return exclude_odometry(loose, modes);
}

FilterState FaultDetection::exclude_odometry(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  FilterState next = belief;
  next.bookkeeping.excluded.wheels = true;
  monitors_.odometry.exclude(now);
  odometry_agrees_s_ = 0.0;
  odometry_judged_ = now;
  return found(Finding::kOdometryFaulty, next, belief, modes);
}

std::optional<FilterState> FaultDetection::judge_excluded_odometry(const Model& model,
                                                                   const OdometrySample& z,
                                                                   const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  // The fault is in the estimated scale of the wheels, too.
  const OdometryParams& params = model.params.odometry;
  NavState x = belief.belief.x;
  x.wheel_scale = 1.0;
  x.slip_per_climb = 0.0;
  const double ahead_mps = speed_ahead(x);
  const double dt_s = std::clamp(seconds(now - odometry_judged_), 0.0, kLongest_s);
  odometry_judged_ = now;
  if (std::max(std::abs(ahead_mps), std::abs(z.speed_mps)) < kMoves_mps) return std::nullopt;
  // Healthy wheels slip now and then.
  const bool turns = x.inertial || others_against_wheels_.turn_alike(now);
  const bool agrees = turns && same(ahead_mps + wheel_speed(x, z, params).r[0], ahead_mps);
  odometry_agrees_s_ = std::max(0.0, odometry_agrees_s_ + (agrees ? dt_s : -2.0 * dt_s));
  if (odometry_agrees_s_ < seconds(monitors_.odometry.wait())) return std::nullopt;
  // A readmission starts all tests again: not while one of them may be about to decide.
  const bool calm = gps_suspect_ == Stamp::min() && gps_test_ratio_ <= kCalm &&
                    ladar_test_ratio_ <= kCalm && ins_test_ratio() <= kInsCalm;
  if (!calm) return std::nullopt;
  monitors_.odometry.readmit(now);
  FilterState next = belief;
  next.belief.x = x;
  for (const int state : {kWheelScale, kClimbSlip}) {
    next.belief.P.row(state).setZero();
    next.belief.P.col(state).setZero();
  }
  next.belief.P(kWheelScale, kWheelScale) = params.scale_sigma * params.scale_sigma;
  next.belief.P(kClimbSlip, kClimbSlip) = params.climb_slip * params.climb_slip;
  next.bookkeeping.excluded.wheels = false;
  return found(Finding::kOdometryReadmitted, next, belief, model.params.modes);
}

bool FaultDetection::odometry_excluded(const FilterState& belief) const {
  return belief.bookkeeping.excluded.wheels && odometry_judged_ != Stamp::min() &&
         belief.belief.x.stamp - odometry_judged_ < kFresh;
}

}  // namespace rcs::wm
