// When the sub-filters branch from the filter, and from which state.
#include <algorithm>

#include "modules/wm/fault_detection/fault_detection.h"

namespace rcs::wm {

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

}  // namespace rcs::wm
