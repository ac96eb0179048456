// Bounds of the errors that faults may have caused before they are found: parts of the protection
// levels.
#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr Duration kFed = from_seconds(1.0);  // newest scan or fix of a filter without INS
constexpr Duration kBetweenScans = from_milliseconds(300.0);

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

/// The distance to where GPS was excluded instead of the INS.
void FaultDetection::bound_keeping_gps(const FilterState& belief) {
  constexpr Duration kDecided = from_seconds(60.0);
  const FilterState& s = keeps_gps_.state;
  const Stamp now = belief.belief.x.stamp;
  if (keeps_gps_.alive() && now - keeps_gps_.began > kDecided) keeps_gps_ = {};
  bound_keeping_gps_ = keeps_gps_.alive() ? distance_to(s, belief) : UndetectedError{};
}

/// The distance to the motion that was given up for fixes that persisted: which of the two was
/// wrong is unknown.
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

}  // namespace rcs::wm
