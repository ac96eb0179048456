// The LADAR against the motion without it, and the a priori map against the motion without the map.
#include <algorithm>

#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"

namespace rcs::wm {
namespace {

// Chi-square, 99.9 %, 2 dof and 1 dof. A larger false-alarm rate than for GPS: continuing without a
// map does little harm.
constexpr double kMapLimit2 = 13.82;
constexpr double kMapLimit1 = 10.83;
// Of a LADAR that is readmitted. The time covers the comparison of motions.
constexpr Duration kLadarAgrees = from_seconds(4.0);
constexpr double kMaxScale = 5.0;    // of its errors
constexpr double kMaxAgainst = 0.3;  // of the votes
// Way on which an a priori map that is readmitted agrees with the fixes. The survey is often right
// near the place where it was matched first, and wrong farther away.
constexpr double kMapAgrees_m = 100.0;

}  // namespace

/// For the LADAR and its map: the test exceeds its limit for too long to be chance.
bool FaultDetection::lasts(bool contradicts, Stamp now, Stamp* since) const {
  if (!contradicts) *since = Stamp::min();
  if (contradicts && *since == Stamp::min()) *since = now;
  return contradicts && now - *since >= params_.ladar_refuted;
}

/// The fixes agree with the motion and contradict the filter with the a priori map.
std::optional<FilterState> FaultDetection::map_is_faulty(const Model& model, const GpsFix& z,
                                                         const FilterState& belief) {
  const Subfilter& motion = without_gps_;
  const Bookkeeping& m = belief.bookkeeping;
  const bool used =
      motion.alive() && !m.excluded.prior_map && m.of(Source::kPriorMap).accepted > motion.branch;
  const bool by_motion = used && gps_test_ratio_ > 1.0 &&
                         nis(motion.state, z, model.params.gps, 0.0).horizontal <= model.gates[2];
  map_contradicted_ = by_motion ? map_contradicted_ + 1 : 0;
  if (map_contradicted_ < params_.refuted_fixes) return std::nullopt;
  return without_map(belief, model.params.modes);
}

FilterState FaultDetection::without_map(const FilterState& belief, const ModeParams& modes) {
  FilterState next = without_gps_.state;
  next.bookkeeping.excluded = belief.bookkeeping.excluded;
  next.bookkeeping.excluded.prior_map = true;
  return found(Finding::kMapFaulty, next, belief, modes);
}

/// The filter with the a priori map against the motion without it. A rotated or distorted survey
/// causes divergence too slow for a single match to show it.
std::optional<FilterState> FaultDetection::judge_prior_match(const FilterState& belief,
                                                             const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  const bool used = belief.bookkeeping.of(Source::kPriorMap).accepted == now;
  if (!used || !without_gps_.alive() || now - without_gps_.branch < kYoung) return std::nullopt;
  map_test_ratio_ = std::max(difference(without_gps_.state, belief, params_.floor_m) / kMapLimit2,
                             heading_difference(without_gps_.state, belief) / kMapLimit1);
  const Vec3 apart =
      without_gps_.state.belief.x.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p;
  map_alternative_m_ = map_test_ratio_ > kCalm ? apart.head<2>().norm() : 0.0;
  // With GPS the difference may also be an error of GPS: judge_fix() decides.
  const bool by_fixes = belief.bookkeeping.of(Source::kGpsPosition).accepted > now - kFresh;
  const bool contradicts = map_test_ratio_ > 1.0 && (!by_fixes || gps_test_ratio_ <= kCalm);
  if (!lasts(contradicts, now, &map_suspected_since_)) return std::nullopt;
  return without_map(belief, modes);
}

/// Fixes alone can show that the map is right again: without them the filter becomes so uncertain
/// that it agrees with any map.
std::optional<FilterState> FaultDetection::judge_excluded_map(const FilterState& belief,
                                                              const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  const bool by_fixes = belief.bookkeeping.of(Source::kGpsPosition).accepted > now - kFresh;
  map_test_ratio_ = 0.0;
  if (!by_fixes || !map_right_.alive()) {
    map_right_ = {};
    if (!by_fixes) return std::nullopt;
    map_right_ = {belief, now, belief.bookkeeping.distance_m};
    map_right_.state.bookkeeping.excluded.prior_map = false;
    map_right_.state.bookkeeping.of(Source::kPriorMap).refused = 0;
    return std::nullopt;
  }
  const double ratio = std::max(difference(belief, map_right_.state, params_.floor_m) / kMapLimit2,
                                heading_difference(belief, map_right_.state) / kMapLimit1);
  if (ratio > kCalm) {
    map_right_ = {};
    return std::nullopt;
  }
  map_test_ratio_ = ratio;
  if (map_right_.agreed < params_.matches ||
      belief.bookkeeping.distance_m - map_right_.began_m < kMapAgrees_m ||
      now - map_right_.began < monitors_.prior_map.wait()) {
    return std::nullopt;
  }
  return found(Finding::kMapReadmitted, map_right_.state, belief, modes);
}

std::optional<FilterState> FaultDetection::judge_match(const FilterState& belief,
                                                       const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  ladar_right_ = {};
  if (!without_ladar_.alive() || now - without_ladar_.branch < kYoung) return std::nullopt;
  const Stamp fix = without_ladar_.state.bookkeeping.of(Source::kGpsPosition).accepted;
  const bool by_fixes = fix > now - kFresh;
  // Without LADAR, INS and fixes the motion is extrapolated: no judge of a registration.
  if (!uses_forces(without_ladar_.state) && !by_fixes) {
    ladar_test_ratio_ = ladar_height_ratio_ = 0.0;
    return std::nullopt;
  }
  // The height, too: a mount that was knocked downwards lets the map climb. Not while the heights
  // of the fixes are in doubt, which the filter without LADAR takes over sooner.
  const bool heights_agree = belief.bookkeeping.heights_refused == 0;
  ladar_height_ratio_ =
      heights_agree ? height_separation(without_ladar_.state, belief, params_.floor_m) / limit_1_
                    : 0.0;
  ladar_test_ratio_ = std::max(difference(without_ladar_.state, belief, params_.floor_m) / limit_2_,
                               ladar_height_ratio_);
  // With GPS the difference may also be an error of GPS: judge_fix() decides.
  const int refused = belief.bookkeeping.of(Source::kGpsPosition).refused;
  const bool contradicts =
      ladar_test_ratio_ > 1.0 && (!by_fixes || (gps_test_ratio_ < kCalm && refused == 0));
  if (!lasts(contradicts, now, &ladar_suspected_since_)) return std::nullopt;
  // The filter without LADAR turns as the INS, which the wheels contradict, too.
  const bool turned = votes_.unconfirmed_turns() > 0.5;
  if (turned && without_ins_.alive() && !belief.bookkeeping.excluded.any_of_ins()) {
    return exclude_ins(belief, modes);
  }
  if (without_ins_.alive() &&
      (ins_by_ladar_.ratio > 1.0 || monitors_.ins.recently_readmitted(now))) {
    const Faulty faulty = ins_or_ladar(now);
    if (faulty == Faulty::kIns) return exclude_ins(belief, modes);
    // The filter without LADAR consists mainly of the INS, which may be the faulty one.
    if (faulty == Faulty::kUnknown) return std::nullopt;
  }
  if (!by_fixes && uses_wheels(without_ladar_.state) && ins_sides_with_ladar(belief)) {
    return exclude_odometry(belief, modes);
  }
  if (!by_fixes && is_left_by_gps(now)) {
    if (wheels_contradict_ins(without_ladar_.state)) return exclude_odometry(belief, modes);
    if (without_gps_.alive()) return exclude_gps(false, belief, modes);
    without_ladar_ = without_ladar_young_ = {};
    return std::nullopt;
  }
  return exclude_ladar(belief, modes);
}

/// A GPS that was wrong before it fell silent has moved the filter without LADAR, which the others
/// hold less, away from the motion by INS and by LADAR, which agree with each other and the wheels.
bool FaultDetection::is_left_by_gps(Stamp now) const {
  const Stamp fix = without_ladar_.state.bookkeeping.of(Source::kGpsPosition).accepted;
  const bool compared = ins_by_ladar_.tested != Stamp::min() && now - ins_by_ladar_.tested < kFresh;
  return fix >= without_ladar_.branch && compared && ins_by_ladar_.ratio <= kCalm &&
         votes_.verdict() > -kMaxAgainst;
}

FilterState FaultDetection::exclude_ladar(const FilterState& belief, const ModeParams& modes) {
  FilterState next = without_ladar_.state;
  next.bookkeeping.excluded = belief.bookkeeping.excluded;
  next.bookkeeping.excluded.ladar = true;
  ladar_poor_m_ = kNever_m;
  return found(Finding::kLadarFaulty, next, belief, modes);
}

std::optional<FilterState> FaultDetection::judge_quarantined_match(const FilterState& belief,
                                                                   const ModeParams& modes) {
  if (!ladar_right_.alive()) {
    // It starts a map epoch of its own at the next match.
    ladar_right_ = {belief, belief.belief.x.stamp, belief.bookkeeping.distance_m};
    ladar_right_.state.bookkeeping.excluded.ladar = false;
    ladar_right_.state.bookkeeping.of(Source::kRolling).refused = 0;
    ladar_right_.state.belief.x.map_epoch = -1;
    return std::nullopt;
  }
  if (ladar_right_.agreed < params_.matches) return std::nullopt;
  if (belief.belief.x.stamp - ladar_right_.began < kLadarAgrees) return std::nullopt;
  // With a large scale it agrees with everything.
  const LadarScale scale = votes_.ladar_scale();
  if (std::max(scale.position, scale.rotation) > kMaxScale || votes_.verdict() < -kMaxAgainst) {
    return std::nullopt;
  }
  ladar_test_ratio_ =
      std::max(difference(belief, ladar_right_.state, params_.floor_m) / limit_2_,
               height_separation(belief, ladar_right_.state, params_.floor_m) / limit_1_);
  if (ladar_test_ratio_ > kCalm) return std::nullopt;
  return found(Finding::kLadarReadmitted, ladar_right_.state, belief, modes);
}

}  // namespace rcs::wm
