// Odometry: excluded if it is what contradicts two sources that agree, and its readmission. The
// innovation gate and the slip states take short errors.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/fault_detection.h"

namespace rcs::wm {
namespace {

// Difference from the speed of the filter at which wheels that were excluded agree with it.
constexpr double kSame_mps = 0.1;
constexpr double kSameShare = 0.03;
constexpr Duration kAgrees = from_seconds(5.0);
constexpr Duration kLongestWait = from_seconds(300.0);
constexpr Duration kRelapse = from_seconds(60.0);  // after a readmission

}  // namespace

/// The position by the INS alone is nearer to that of the filter, which is by the LADAR, than to
/// that of the sub-filter by INS and wheels.
bool Trust::ins_sides_with_ladar(const FilterState& belief) const {
  const Subfilter& inertial = inertial_.subfilter;
  if (!inertial.alive() || ins_by_ladar_.ratio > kCalm) return false;
  const auto place = [](const FilterState& s) {
    return Vec2(s.belief.x.T_world_vehicle.p.head<2>());
  };
  const Cov& P = inertial.state.belief.P;
  const double sigma_m = std::sqrt(P.diagonal().segment<2>(kPosition).maxCoeff()) -
                         std::sqrt(belief.belief.P.diagonal().segment<2>(kPosition).minCoeff());
  const double apart_m = (place(without_ladar_.state) - place(belief)).norm();
  return std::max(sigma_m, (place(inertial.state) - place(belief)).norm()) < 0.5 * apart_m;
}

FilterState Trust::exclude_odometry(const FilterState& from, const FilterState& belief,
                                    const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  FilterState next = from;
  next.memory.withheld = belief.memory.withheld;
  next.memory.withheld.wheels = true;
  if (belief.memory.gps_accused) {
    next.memory.withheld.gps = next.memory.gps_accused = false;
    next.memory.of(Source::kGpsPosition).refused = 0;
  }
  const bool relapse =
      odometry_readmitted_ != Stamp::min() && now - odometry_readmitted_ < kRelapse;
  odometry_wait_ = relapse ? std::min<Duration>(2 * odometry_wait_, kLongestWait) : kAgrees;
  odometry_agrees_ = Stamp::min();
  return found(Finding::kOdometryFaulty, next, belief, modes);
}

std::optional<FilterState> Trust::judge_excluded_odometry(const Model& model,
                                                          const OdometrySample& z,
                                                          const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  // The fault is in the estimated scale of the wheels, too.
  const OdometryParams& params = model.params.odometry;
  NavState x = belief.belief.x;
  x.wheel_scale = 1.0;
  x.slip_per_climb = 0.0;
  const double off_mps = std::abs(wheel_speed(x, z, params).r[0]);
  if (off_mps > kSame_mps + kSameShare * std::abs(z.speed_mps)) {
    odometry_agrees_ = Stamp::min();
    return std::nullopt;
  }
  if (odometry_agrees_ == Stamp::min()) odometry_agrees_ = now;
  if (now - odometry_agrees_ < odometry_wait_) return std::nullopt;
  odometry_readmitted_ = now;
  FilterState next = belief;
  next.belief.x = x;
  for (const int state : {kWheelScale, kClimbSlip}) {
    next.belief.P.row(state).setZero();
    next.belief.P.col(state).setZero();
  }
  next.belief.P(kWheelScale, kWheelScale) = params.scale_sigma * params.scale_sigma;
  next.belief.P(kClimbSlip, kClimbSlip) = params.climb_slip * params.climb_slip;
  next.memory.withheld.wheels = false;
  return found(Finding::kOdometryReadmitted, next, belief, model.params.modes);
}

}  // namespace rcs::wm
