// A GPS that is excluded: how its fixes become right again, or show that the filter is wrong.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

// After an outage: largest gyro bias that is not found without fixes, and the error of the heading.
constexpr double kUndetected_radps = 0.001;
constexpr double kHeading_rad = 0.05;
// Fixes within the possible error are accepted after this time and distance.
constexpr Duration kPossible = from_seconds(8.0);
constexpr double kPossible_m = 20.0;
constexpr double kMaxPossible_m = 10.0;  // farther off they are more likely wrong
constexpr double kClimb_m = 0.5;         // drift of the height that the filter does not know of
// Chi-square, 99 %, 2 dof and 1 dof: a false readmission is worse than a late one.
constexpr double kLimit = 9.21;
constexpr double kLimit1 = 6.63;

}  // namespace

/// Begins the alternative hypothesis that the fix is right and the position of the filter is wrong.
/// The heading is kept, because a drift of the fixes would look like another heading; after an
/// outage it is wrong by what a gyro bias has caused that is too small to be found without fixes.
void FaultDetection::suppose_gps_right(const Model& model, const GpsFix& z,
                                       const FilterState& belief) {
  const NavState& x = belief.belief.x;
  const Vec3 off = gps_position(x, z, model.params.gps).r;
  gps_right_ = {belief, x.stamp, belief.bookkeeping.distance_m};
  const Stamp accepted = belief.bookkeeping.of(Source::kGpsPosition).accepted;
  if (!belief.bookkeeping.gps_suspected && accepted != Stamp::min()) {
    gps_right_.heading_rad =
        std::min(kUndetected_radps * seconds(x.stamp - accepted), kHeading_rad);
  }
  FilterState& s = gps_right_.state;
  s.belief = loosen_world(belief.belief, off.cwiseAbs() + z.sigma_m, gps_right_.heading_rad);
  s.bookkeeping.excluded.gps = s.bookkeeping.gps_suspected = false;
  s.bookkeeping.of(Source::kGpsPosition).refused = 0;
  Innovations unread;
  apply(model, {x.stamp, z}, &s, &unread);
}

/// Slowly drifting fixes contradict neither the last fix nor a filter that follows them, but the
/// motion: their distance from the filter changes by more than the filter can have drifted.
bool FaultDetection::keeps_its_shape(const Model& model, const GpsFix& z,
                                     const FilterState& belief) {
  const Vec3 r = gps_position(belief.belief.x, z, model.params.gps).r;
  const Vec2 off = r.head<2>();
  const double variance = largest_variance(horizontal(belief));
  const double up_variance = belief.belief.P(kPosition + 2, kPosition + 2);
  if (gps_right_.variance_m2 == 0.0) {
    gps_right_.off = off;
    gps_right_.variance_m2 = variance;
    gps_right_.up_m = r.z();
    gps_right_.up_variance_m2 = up_variance;
  }
  const double turned_m =
      gps_right_.heading_rad * (belief.bookkeeping.distance_m - gps_right_.began_m);
  const double drifted = std::max(0.0, variance - gps_right_.variance_m2) + turned_m * turned_m;
  const double fixes = 2.0 * z.sigma_m.head<2>().cwiseAbs2().maxCoeff();
  const double up_m = r.z() - gps_right_.up_m;
  const double up = std::max(0.0, up_variance - gps_right_.up_variance_m2) +
                    2.0 * z.sigma_m.z() * z.sigma_m.z() + kClimb_m * kClimb_m;
  // After an outage, and without the forces of the INS, it is the height of the filter that drifts.
  const bool climbs =
      belief.bookkeeping.gps_suspected && uses_forces(belief) && up_m * up_m > kLimit1 * up;
  return !climbs && (off - gps_right_.off).squaredNorm() <= kLimit * (drifted + fixes);
}

/// The velocities of the fixes since the hypothesis began contradict the filter: they drift.
bool FaultDetection::drifts(const Model& model, const GpsFix& z, const FilterState& belief) {
  FixDrift& drift = gps_right_.drift;
  if (z.has_velocity) {
    const NavState& x = belief.belief.x;
    const Residual<3> r = gps_velocity(x, z, model.params.gps, accel_world(belief));
    drift.add(r.r.head<2>(), x.v_world.head<2>(), std::sqrt(r.R.diagonal().head<2>().maxCoeff()));
  }
  Mat<2, 2> own = belief.belief.P.block<2, 2>(kVelocity, kVelocity);
  own.diagonal().array() += params_.floor_mps * params_.floor_mps;
  const double yaw_variance = belief.belief.P(kAttitude + 2, kAttitude + 2);
  const double d2 =
      drift.squared_mahalanobis(std::hypot(std::sqrt(yaw_variance), gps_right_.heading_rad), own);
  return d2 > kLimit;
}

double FaultDetection::possible_error_m(const FilterState& belief) const {
  const double sigma_m = std::sqrt(largest_variance(horizontal(belief)));
  return std::max(kHorizontalQuantile * sigma_m,
                  undetected_by_tests(belief.belief.x.stamp).horizontal_m);
}

/// The velocity of the fix agrees with the filter.
bool FaultDetection::moves_along(const Model& model, const GpsFix& z,
                                 const FilterState& belief) const {
  if (!z.has_velocity) return true;
  const Residual<3> r = gps_velocity(belief.belief.x, z, model.params.gps, accel_world(belief));
  Mat<2, 2> S = (r.H * belief.belief.P * r.H.transpose() + r.R).topLeftCorner<2, 2>();
  S.diagonal().array() += params_.floor_mps * params_.floor_mps;
  const Vec2 off = r.r.head<2>();
  const double up = (r.H * belief.belief.P * r.H.transpose() + r.R)(2, 2);
  return off.dot(S.llt().solve(off)) <= kLimit && r.r.z() * r.r.z() <= kLimit1 * up;
}

/// By how much the heading may be wrong: unknown after a gap or a fault of the INS; otherwise by
/// what a gyro bias may have caused since a sub-filter branched that has replaced the filter.
/// Beyond it the fixes are what has turned.
double FaultDetection::possible_turn_rad(const FilterState& belief) const {
  constexpr double kSigmas = 3.0;
  const Bookkeeping& m = belief.bookkeeping;
  const Stamp known = m.of(Source::kGpsPosition).accepted;
  if (known == Stamp::min()) return kPi;
  const Stamp since = known - 2 * params_.branch;
  const bool lost = !uses_forces(belief) || std::max(m.ins_lost, m.ins_gap_end) > since ||
                    monitors_.ins.excluded() > since;
  if (lost) return kPi;
  const double sigma_rad = std::sqrt(belief.belief.P(kAttitude + 2, kAttitude + 2));
  return kSigmas * sigma_rad + kUndetected_radps * seconds(belief.belief.x.stamp - since);
}

/// A gap of all inputs, or an undetected gyro bias in an outage, leaves a heading that is wrong by
/// degrees with a claim of less. No fix is within the possible error any more, and the filter would
/// reject GPS for ever.
std::optional<FilterState> FaultDetection::heading_is_wrong(const Model& model, const GpsFix& z,
                                                            const FilterState& belief) {
  const NavState& x = belief.belief.x;
  TurnedPath::Fix fix{z.p_world, z.sigma_m.head<2>().maxCoeff()};
  if (z.has_velocity) {
    // Without the velocity of the antenna against the vehicle.
    const Residual<3> r = gps_velocity(x, z, model.params.gps, accel_world(belief));
    fix.v_mps = x.v_world + r.r;
    fix.sigma_mps = std::sqrt(r.R.diagonal().head<2>().maxCoeff());
  }
  turned_.add(x.stamp,
              {x.T_world_vehicle * model.params.gps.lever_m, x.v_world,
               (x.T_world_vehicle.q * x.rate_vehicle).z()},
              fix);
  const std::optional<TurnedPath::Turn> turn = turned_.found();
  if (!turn || std::abs(yaw_of(turn->T_new_old.q)) > possible_turn_rad(belief)) return std::nullopt;
  FilterState next = belief;
  const double off_m = std::abs(gps_position(x, z, model.params.gps).r.z());
  const Vec3 sigma(turn->sigma_m, turn->sigma_m, std::hypot(off_m, z.sigma_m.z()));
  next.belief =
      loosen_world(change_world(belief.belief, turn->T_new_old), sigma, turn->sigma_yaw_rad);
  next.bookkeeping.excluded.gps = next.bookkeeping.gps_suspected = false;
  next.bookkeeping.of(Source::kGpsPosition).refused = 0;
  return found(Finding::kFilterFaulty, next, belief, model.params.modes);
}

std::optional<FilterState> FaultDetection::judge_quarantined_fix(const Model& model,
                                                                 const GpsFix& z,
                                                                 const FilterState& belief) {
  const NavState& x = belief.belief.x;
  const Bookkeeping& m = belief.bookkeeping;
  if (before_.alive()) {  // accepted against the filter, and now contradicts itself
    return found(Finding::kGpsReadmissionRevoked, before_.state, belief, model.params.modes);
  }
  if (sides_with_given_up(model, z, belief)) {
    return found(Finding::kGpsReadmissionRevoked, given_up_.state, belief, model.params.modes);
  }
  const Nis n = nis(belief, z, model.params.gps, 0.0);
  gps_test_ratio_ = n.horizontal / model.gates[2];
  if (gps_is_right(x.stamp)) return exclude_ins(belief, model.params.modes);
  if (std::optional<FilterState> change = map_is_faulty(model, z, belief)) return change;
  if (std::optional<FilterState> change = heading_is_wrong(model, z, belief)) return change;
  if (gps_right_.alive() && !keeps_its_shape(model, z, belief)) gps_right_ = {};
  if (!gps_right_.alive()) suppose_gps_right(model, z, belief);
  const bool consistent = gps_right_.alive() && gps_right_.refused_in_row == 0;
  const bool drifting = drifts(model, z, belief);
  // After an outage the height has drifted, and that of the fixes is right.
  const bool height = !m.gps_suspected || n.vertical <= model.gates[1];
  const bool agrees =
      consistent && height && n.horizontal <= model.gates[2] && moves_along(model, z, belief);
  agreeing_[fixes_++ % agreeing_.size()] = agrees;
  if (!agrees) agreeing_since_ = Stamp::min();
  if (agrees && agreeing_since_ == Stamp::min()) agreeing_since_ = x.stamp;
  const bool settled = gps_right_.agreed >= params_.agreeing;
  const Vec3 apart = gps_right_.state.belief.x.T_world_vehicle.p - x.T_world_vehicle.p;
  alternative_m_ = settled && !agrees ? apart.head<2>().norm() : 0.0;
  const auto agreeing = std::count(agreeing_.begin(), agreeing_.end(), true);
  if (agreeing >= params_.agreeing && agrees && x.stamp - agreeing_since_ >= params_.agreeing_for) {
    FilterState next = belief;
    if (!m.gps_suspected && n.vertical > model.gates[1]) {
      // The height has drifted in the outage: it would reject the heights of the fixes for ever.
      const double off_m = std::abs(gps_position(x, z, model.params.gps).r.z());
      next.belief = loosen_world(belief.belief, Vec3(0.0, 0.0, off_m), 0.0);
    }
    next.bookkeeping.excluded.gps = next.bookkeeping.gps_suspected = false;
    next.bookkeeping.of(Source::kGpsPosition).refused = 0;
    next = found(Finding::kGpsReadmitted, next, belief, model.params.modes);
    if (drifting) given_up_ = {belief, x.stamp};
    bound_given_up(next);
    return next;
  }
  // A position within the protection level contradicts nothing that is known after an outage.
  const double possible_m = std::min(possible_error_m(belief), kMaxPossible_m);
  const bool possible = !m.gps_suspected && !drifting && apart.head<2>().norm() <= possible_m;
  const bool persistent =
      consistent &&
      x.stamp - gps_right_.began >=
          (possible ? std::min(kPossible, params_.persistent) : params_.persistent) &&
      m.distance_m - gps_right_.began_m >=
          (possible ? std::min(kPossible_m, params_.persistent_m) : params_.persistent_m) &&
      gps_right_.agreed >= 9 * gps_right_.refused;
  if (!persistent) return std::nullopt;
  FilterState next = found(Finding::kFilterFaulty, gps_right_.state, belief, model.params.modes);
  given_up_ = {belief, x.stamp};
  bound_given_up(next);
  return next;
}

/// Fixes that were wrong and are right again contradict the filter that has followed them, and
/// agree with the motion that was given up.
bool FaultDetection::sides_with_given_up(const Model& model, const GpsFix& z,
                                         const FilterState& belief) {
  constexpr int kInRow = 3;
  if (!given_up_.alive()) return false;
  const FilterState& s = given_up_.state;
  const double gate = model.gates[2];
  const bool agrees = nis(belief, z, model.params.gps, 0.0).horizontal > gate &&
                      nis(s, z, model.params.gps, 0.0).horizontal <= gate &&
                      moves_along(model, z, s);
  agree_with_given_up_ = agrees ? agree_with_given_up_ + 1 : 0;
  return agree_with_given_up_ >= kInRow;
}

}  // namespace rcs::wm
