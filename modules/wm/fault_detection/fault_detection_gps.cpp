// GPS against the motion while it is fused.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

constexpr double kMaxExcess =
    5.0;  // contribution of one fix at most: a single outlier is not enough
constexpr Duration kWheelsFresh = from_seconds(0.3);
// After the first contradiction of the fixes; a fault of another source shows by then.
constexpr Duration kShows = from_seconds(1.5);
// Differences of speeds, low-passed.
constexpr double kSpeedShare = 0.2;  // of the newest
constexpr double kUnlike_mps = 10.0;
constexpr double kSame_mps = 0.1;
constexpr double kSameShare = 0.02;
constexpr double kNearerSpeed = 0.4;

}  // namespace

/// Cumulative sums (Page 1954) of the excess of the GPS velocity, in both directions of each axis:
/// they detect slow drifts. The velocity error of the sub-filter, above all from its heading, is
/// common to all fixes, so that no sum averages it out: three standard deviations of it are
/// subtracted.
void FaultDetection::sum_velocity(const Model& model, const GpsFix& z) {
  if (!z.has_velocity) return;
  constexpr double kLetPass = 3.0;
  const FilterState& s = without_gps_.state;
  const Residual<3> r = gps_velocity(s.belief.x, z, model.params.gps, accel_world(s));
  const Mat3 shared = r.H * s.belief.P * r.H.transpose();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double white = std::sqrt(r.R(axis, axis));
    const double passed = kLetPass * std::hypot(std::sqrt(shared(axis, axis)), params_.floor_mps);
    double& up = cusum_[2 * axis];
    double& down = cusum_[2 * axis + 1];
    up = std::max(0.0, up + std::min((r.r[axis] - passed) / white, kMaxExcess));
    down = std::max(0.0, down + std::min((-r.r[axis] - passed) / white, kMaxExcess));
  }
}

/// The speed of the motion without GPS, and that of the wheels, against the speed of the fixes.
void FaultDetection::compare_speeds(const Model& model, const GpsFix& z,
                                    const FilterState& others) {
  if (!z.has_velocity) return;
  const NavState& x = others.belief.x;
  // Without the velocity of the antenna against the vehicle.
  const double fix_mps =
      (x.v_world + gps_velocity(x, z, model.params.gps, accel_world(others)).r).norm();
  const bool fresh = wheels_received_ > x.stamp - kWheelsFresh;
  const double wheels_mps = fresh ? std::abs(wheels_mps_) - fix_mps : kUnlike_mps;
  speeds_.others_mps += kSpeedShare * (x.v_world.norm() - fix_mps - speeds_.others_mps);
  speeds_.wheels_mps += kSpeedShare * (wheels_mps - speeds_.wheels_mps);
  speeds_.fix_mps = fix_mps;
}

/// Fixes and wheels have the same speed, and the motion without GPS has another one.
bool FaultDetection::speeds_side_with_fix() const {
  const double apart_mps = std::abs(speeds_.others_mps);
  return apart_mps > kSame_mps + kSameShare * speeds_.fix_mps &&
         std::abs(speeds_.wheels_mps) < kNearerSpeed * apart_mps;
}

/// A motion that diverges from the fixes has another velocity than they. Fixes that move away from
/// it faster jump.
void FaultDetection::watch_jumps(const Model& model, const GpsFix& z, Stamp now) {
  constexpr Duration kPrevious = from_seconds(4.0);
  constexpr double kUnlikely = 4.0;  // sigmas
  constexpr double kAccelerating = 2.0;
  if (!without_gps_.alive() || !z.has_velocity) {
    offset_ = {};
    return;
  }
  const FilterState& s = without_gps_.state;
  const Vec2 off_m = gps_position(s.belief.x, z, model.params.gps).r.head<2>();
  const double off_mps =
      gps_velocity(s.belief.x, z, model.params.gps, accel_world(s)).r.head<2>().norm();
  const Duration since = now - offset_.stamp;
  if (offset_.stamp != Stamp::min() && since < kPrevious) {
    const double moved_m = kAccelerating * std::max(off_mps, offset_.rate_mps) * seconds(since);
    const double sigma_m = z.sigma_m.head<2>().maxCoeff();
    if ((off_m - offset_.at_m).norm() > moved_m + kUnlikely * sigma_m) jumped_ = now;
  }
  offset_ = {now, off_m, off_mps};
}

/// The fix against the position without GPS since the branch. The correlation of the filter with
/// the time-correlated GPS error makes this a test of the shape of the fixes, not of their
/// position.
std::optional<FilterState> FaultDetection::judge_fix(const Model& model, const GpsFix& z,
                                                     const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  const SourceRecord& record = belief.bookkeeping.of(Source::kGpsPosition);
  alternative_m_ = 0.0;
  gps_right_ = {};
  turned_ = {};
  // No more matches can clear the test of the a priori map, and an accepted fix gives the position.
  const Stamp mapped = belief.bookkeeping.of(Source::kPriorMap).accepted;
  if (record.accepted == now && mapped < now - kFresh) map_test_ratio_ = map_alternative_m_ = 0.0;
  if (before_.alive() && !monitors_.gps.on_probation(now)) before_ = {};
  agreeing_.fill(false);
  agreeing_since_ = Stamp::min();
  if (!without_gps_.alive() || now - without_gps_.branch < kYoung) return std::nullopt;
  const double way_m = belief.bookkeeping.distance_m - without_gps_began_m_;
  const Nis n = nis(without_gps_.state, z, model.params.gps, params_.floor_share * way_m);
  detectable_m_ = std::sqrt(limit_2_) * n.sigma_m;
  double deviating = n.horizontal / limit_2_;
  if (belief.bookkeeping.heights_refused == 0) {
    deviating = std::max(deviating, n.vertical / limit_1_);
  }
  sum_velocity(model, z);
  compare_speeds(model, z, without_gps_.state);
  const double drifting = cusum_.maxCoeff() / params_.cusum;
  gps_test_ratio_ = std::max(deviating, drifting);
  if (gps_test_ratio_ < kQuiet && record.accepted == now) gps_quiet_ = now;
  // A fix that the gate rejected has not changed the filter.
  const bool harmful = record.accepted == now;
  suspicious_fixes_ = harmful && deviating > 1.0 ? suspicious_fixes_ + 1 : 0;
  if (suspicious_fixes_ < params_.refuted_fixes && !(harmful && drifting > 1.0)) {
    gps_contradicts_ = Stamp::max();
    keeps_gps_ = {};
    return std::nullopt;
  }
  if (gps_contradicts_ == Stamp::max()) {
    gps_contradicts_ = now;
    suppose_ins_faulty(belief);
  }
  // A vehicle that has lost its INS predicts its motion by extrapolation: GPS is the better source.
  if (!uses_forces(belief)) return std::nullopt;
  if (std::optional<FilterState> change = exclude_other_than_gps(model, z, belief)) return change;
  // If GPS alone were faulty, INS and LADAR would agree: which of the two it is shows soon.
  constexpr Duration kShowsLater = from_seconds(3.0);
  constexpr Duration kShowsSurely = from_seconds(8.0);
  const bool others_disagree = ins_by_ladar_.ratio > kCalm && !ladar_is_poor();
  const Duration later = ins_by_ladar_.ratio > 1.0 ? kShowsSurely : kShowsLater;
  if (now - gps_contradicts_ < (others_disagree ? later : kShows)) return std::nullopt;
  return exclude_gps(ins_is_confirmed(model, z), belief, model.params.modes);
}

/// The filter has rejected several fixes in a row, which withholds GPS at once. A fault of another
/// source shows soon after; until then no sub-filter replaces the filter.
std::optional<FilterState> FaultDetection::judge_suspect_fix(const Model& model, const GpsFix& z,
                                                             const FilterState& belief) {
  const Nis n = nis(belief, z, model.params.gps, 0.0);  // reported as the cause
  gps_test_ratio_ = std::max(n.horizontal / model.gates[2], n.vertical / model.gates[1]);
  if (std::optional<FilterState> change = exclude_other_than_gps(model, z, belief)) return change;
  return exclude_suspect_gps(model, z, belief);
}

/// Fixes and the sub-filter without them contradict each other: excludes the INS, the LADAR
/// or odometry if one of them is known to be the faulty one.
std::optional<FilterState> FaultDetection::exclude_other_than_gps(const Model& model,
                                                                  const GpsFix& z,
                                                                  const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  // Fixes that were accepted against the motion have moved the filter and turned it, and with it
  // the INS: a weak contradiction of the INS comes from them.
  const bool doubtful = given_up_.alive();
  const bool by_wheels = !doubtful && ins_by_gps_.lasts(now, Duration::zero()) &&
                         !ins_by_ladar_.lasts(now, Duration::zero()) && wheels_vote_ > 0.5;
  const double suspect = doubtful ? kContradicts : 0.5;
  const Faulty faulty = ins_or_ladar(now);
  const bool by_ladar =
      (ins_by_ladar_.ratio > suspect && faulty == Faulty::kIns) ||
      (ins_by_ladar_.ratio > kContradicts && faulty == Faulty::kUnknown && !ladar_is_poor());
  // What jumps is GPS: a weak sign of a faulty INS is chance.
  const bool jumped = jumped_ != Stamp::min() && now - jumped_ < kConsequence;
  const bool by_constraint = violates_constraint(kSuspectAcross) && !jumped && !doubtful;
  // LADAR and wheels with the fixes are three against the INS, the INS with the fixes two against
  // the LADAR.
  const bool by_fixes = fix_vote_ > 0.0 || sides_with_fix(model, z, neither_);
  // An INS that is readmitted during its fault contradicts the fixes within seconds.
  const bool relapse = monitors_.ins.on_probation(now);
  const bool by_turn = !ins_is_confirmed(model, z) && gps_is_right(now);
  // A LADAR that does not observe the speed follows that of the INS.
  const bool by_speed = speeds_side_with_fix() && votes_.sigma_ahead_m() > kObserved_m;
  if (without_ins_.alive() &&
      (by_wheels || by_ladar || by_constraint || by_fixes || by_turn || by_speed || relapse)) {
    return exclude_ins(belief, model.params.modes);
  }
  // A faulty LADAR also contradicts the INS.
  if (ins_by_ladar_.ratio > kCalm && !violates_constraint(kFollowsConstraint) &&
      (fix_vote_ < 0.0 || sides_with_fix(model, z, inertial_.subfilter))) {
    FilterState next = without_ladar_.state;
    next.bookkeeping.excluded = belief.bookkeeping.excluded;
    next.bookkeeping.excluded.gps = next.bookkeeping.gps_suspected = false;
    next.bookkeeping.of(Source::kGpsPosition).refused = 0;
    next.bookkeeping.excluded.ladar = true;
    next.belief.x.map_epoch = -1;  // not known without the excluded source
    return found(Finding::kLadarFaulty, next, belief, model.params.modes);
  }
  // Not if the filter has rejected the fixes: the wheels have moved it, too.
  if (gps_suspect_ != Stamp::min() || !wheels_are_left(model, z)) return std::nullopt;
  return exclude_odometry(belief, model.params.modes);
}

/// Whether the motion without GPS and INS agrees with the INS against the fix, and is known well
/// enough for that. On dunes the LADAR observes no heading, and follows that of the INS.
bool FaultDetection::ins_is_confirmed(const Model& model, const GpsFix& z) const {
  if (!neither_.alive()) return false;
  const FilterState& s = without_gps_.state;
  const Belief& other = neither_.state.belief;
  const Vec2 off = gps_position(s.belief.x, z, model.params.gps).r.head<2>();
  const Vec2 apart = (other.x.T_world_vehicle.p - s.belief.x.T_world_vehicle.p).head<2>();
  const double sigma_m = std::sqrt(largest_variance(horizontal(neither_.state)));
  return std::max(sigma_m, apart.norm()) < 0.5 * off.norm();
}

/// Unless the LADAR confirms the INS, the alternative that the INS is faulty stays. If it does, the
/// motion that was given up for the fixes was right.
/// @param confirmed  the LADAR confirms the INS
FilterState FaultDetection::exclude_gps(bool confirmed, const FilterState& belief,
                                        const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  const bool on_probation = monitors_.gps.on_probation(now);
  // The one that has drifted less, if the fault cannot have had an effect on it.
  const bool recent = without_gps_young_.alive() && gps_quiet_ != Stamp::min() &&
                      without_gps_young_.branch <= gps_quiet_ - kBefore;
  FilterState next = confirmed && given_up_.alive() ? given_up_.state
                     : recent                       ? without_gps_young_.state
                                                    : without_gps_.state;
  next.bookkeeping.excluded.prior_map = belief.bookkeeping.excluded.prior_map;
  next.bookkeeping.excluded.gps = next.bookkeeping.gps_suspected = true;
  const Hypothesis kept = confirmed ? Hypothesis{} : keeps_gps_;
  FilterState state = found(on_probation ? Finding::kGpsReadmissionRevoked : Finding::kGpsFaulty,
                            next, belief, modes);
  keeps_gps_ = kept;
  return state;
}

/// Begins the alternative that the INS is faulty, not GPS.
void FaultDetection::suppose_ins_faulty(const FilterState& belief) {
  keeps_gps_ = {};
  if (!without_ins_.alive() || belief.bookkeeping.excluded.any_of_ins()) return;
  keeps_gps_ = {without_ins_.state, belief.belief.x.stamp, belief.bookkeeping.distance_m};
  Bookkeeping& m = keeps_gps_.state.bookkeeping;
  m.excluded.gps = m.gps_suspected = false;
  m.of(Source::kGpsPosition).refused = 0;
}

bool FaultDetection::accepts_fixes(const Hypothesis& with_gps) {
  constexpr int kShare = 9;  // accepted for each rejected one
  return with_gps.alive() && with_gps.agreed >= kShare * with_gps.refused;
}

/// The motion by GPS, LADAR and wheels accepts the fixes, and the wheels turn as they do, against
/// the INS, or they differ from the INS as by a wrong gyro.
bool FaultDetection::gps_is_right(Stamp now) const {
  constexpr double kVotes = 0.5;
  constexpr double kLikelihood = 25.0;  // logarithm of the ratio; without a fault up to 20
  constexpr double kLikely = 5.0;       // if the INS is suspect for another reason
  if (!accepts_fixes(keeps_gps_) || keeps_gps_.agreed < kHeldFixes) return false;
  const std::optional<double> shape = course_shape_.gyro_against_fixes();
  if (!shape) return false;
  // An INS that was readmitted during its fault has estimated other biases.
  const bool suspect =
      monitors_.ins.recently_readmitted(now) && !monitors_.gps.recently_readmitted(now);
  return *shape > (suspect || votes_.course_turns() > kVotes ? kLikely : kLikelihood);
}

/// No other source decides. Where the LADAR does not confirm the INS, it may be the faulty one: GPS
/// is excluded, but the decision waits.
std::optional<FilterState> FaultDetection::exclude_suspect_gps(const Model& model, const GpsFix& z,
                                                               const FilterState& belief) {
  constexpr Duration kShowsTurning = from_seconds(4.0);
  const bool undecided = accepts_fixes(keeps_gps_) && !ins_is_confirmed(model, z);
  const Duration shows = undecided ? kShowsTurning : kShows;
  if (belief.belief.x.stamp - gps_suspect_ < shows) return std::nullopt;
  return exclude_gps(ins_is_confirmed(model, z), belief, model.params.modes);
}

/// The courses of the fixes and of the INS, and the speed of the wheels.
void FaultDetection::follow_courses(const Model& model, const Measurement& m) {
  const FilterState& s = inertial_.subfilter.state;
  const NavState& x = s.belief.x;
  if (!inertial_.subfilter.alive()) return;
  if (m.imu() != nullptr) {
    course_shape_.turn(m.stamp, (x.T_world_vehicle.q * x.rate_vehicle).z());
  } else if (const auto* wheels = std::get_if<OdometrySample>(&m.value)) {
    wheels_mps_ = wheels->speed_mps / x.wheel_scale;
    wheels_received_ = m.stamp;
  } else if (const auto* fix = std::get_if<GpsFix>(&m.value)) {
    if (!fix->has_velocity) return;
    // Without the velocity of the antenna against the vehicle.
    const Residual<3> r = gps_velocity(x, *fix, model.params.gps, accel_world(s));
    const bool fresh = wheels_received_ > m.stamp - kWheelsFresh;
    course_shape_.add(m.stamp, (x.v_world + r.r).head<2>(), fresh ? wheels_mps_ : 0.0);
  }
}

/// Whether a motion that contains neither GPS nor one other source agrees with the fix, in position
/// or in velocity, against the motion with that source: which is then faulty, not GPS. If the error
/// of the motion decides neither, GPS is excluded.
bool FaultDetection::sides_with_fix(const Model& model, const GpsFix& z,
                                    const Subfilter& motion) const {
  if (!motion.alive()) return false;
  const FilterState& s = without_gps_.state;
  const NavState& x = s.belief.x;
  const Belief& other = motion.state.belief;
  // The motion is less than half as far from the fix as the filter with the source is.
  const auto sides_with = [&other](const Vec3& fix, const Vec3& moved, int block) {
    const double sigma = std::sqrt(std::max(other.P(block, block), other.P(block + 1, block + 1)));
    const Vec2 d = fix.head<2>();
    return std::max(sigma, (d - moved.head<2>()).norm()) < 0.5 * d.norm();
  };
  const bool by_place = sides_with(gps_position(x, z, model.params.gps).r,
                                   other.x.T_world_vehicle.p - x.T_world_vehicle.p, kPosition);
  return by_place ||
         (z.has_velocity && sides_with(gps_velocity(x, z, model.params.gps, accel_world(s)).r,
                                       other.x.v_world - x.v_world, kVelocity));
}

}  // namespace rcs::wm
