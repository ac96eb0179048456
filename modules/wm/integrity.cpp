#include "modules/wm/integrity.h"

#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/filter_difference.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

constexpr double kFarthest_s = 600.0;

double square(double v) { return v * v; }

/// Where rejected registrations place the vehicle. The tests of the sub-filters are late by the lag
/// of the history; a wrong acceleration moves the filter by metres meanwhile.
Vec3 apart_from_matches(const FilterState& s) {
  const RejectedMatches& m = s.bookkeeping.rejected_matches;
  const bool goes_on = m.reset > s.belief.x.stamp - RejectedMatches::kResetLasts;
  const int in_a_row = goes_on ? 1 : 2;  // one alone is an outlier
  const bool rejected = s.bookkeeping.of(Source::kRolling).refused >= in_a_row;
  return m.displacement(s.belief.x.stamp, rejected);
}

/// Growth of the horizontal variance without fixes.
class Growth {
 public:
  Growth(const FilterState& s, const WmParams& params, bool ladar)
      : ins_(params.ins),
        drive_(params.drive),
        ladar_(ladar),
        gyro_(s.belief.x.inertial),
        forces_(uses_forces(s)) {
    const Cov& P = s.belief.P;
    map_m2_ = square(drive_.rolling_position) + s.bookkeeping.inherited_m2;
    map_rad2_ = square(drive_.rolling_angle) + s.bookkeeping.inherited_rad2;
    speed_mps_ = s.belief.x.v_world.norm();
    variance_ = largest_variance(P.block<2, 2>(kPosition, kPosition));
    velocity_ = std::max(P(kVelocity, kVelocity), P(kVelocity + 1, kVelocity + 1));
    heading_ = P(kAttitude + 2, kAttitude + 2);
    gyro_bias_ = P(kGyroBias + 2, kGyroBias + 2);
    accel_ = P.diagonal().segment<2>(kAccelBias).maxCoeff() +
             square(9.81) * P.diagonal().segment<2>(kAttitude).maxCoeff();
  }

  [[nodiscard]] double sigma_m(double t_s) const {
    const double way_m = speed_mps_ * t_s;
    double grown = variance_ + heading_ * square(way_m);
    const double by_gyro = 0.25 * gyro_bias_ * square(way_m * t_s) +
                           square(ins_.angle_random_walk * way_m) * t_s / 3.0;
    if (ladar_) {
      const double by_map = map_rad2_ * square(way_m) * way_m / 3.0;
      grown += map_m2_ * way_m + (gyro_ ? std::min(by_map, by_gyro) : by_map);
    } else if (forces_) {
      grown += velocity_ * square(t_s) + 0.25 * accel_ * square(square(t_s)) + by_gyro +
               square(ins_.velocity_random_walk) * t_s * square(t_s) / 3.0;
    } else {
      grown += square(speed_mps_ + 1.0) * square(t_s);
    }
    return std::sqrt(grown);
  }

 private:
  ProcessNoise ins_;
  DriveNoise drive_;
  bool ladar_, gyro_, forces_;
  double map_m2_, map_rad2_;  // per metre driven
  double speed_mps_, variance_, velocity_, heading_, gyro_bias_, accel_;
};

}  // namespace

Integrity integrity(const FilterState& state, const FaultDetection& fault_detection,
                    Duration silent_for, const WmParams& params) {
  Integrity out;
  const bool georeferenced = state.bookkeeping.georeferenced;
  const bool pose_valid = silent_for <= params.modes.input_timeout;
  out.validity = !pose_valid     ? Validity::kNone
                 : georeferenced ? Validity::kWorld
                                 : Validity::kLocal;
  const IntegrityParams& limits = params.integrity;
  const SourceStatus gps = fault_detection.gps(state, params.modes);
  const SourceStatus ladar = fault_detection.ladar(state, params.modes);
  const Growth growth(state, params, fused(ladar));
  const double sigma_h = growth.sigma_m(0.0);
  const double sigma_v = std::sqrt(state.belief.P(kPosition + 2, kPosition + 2));
  constexpr int kSeveral = 3;  // fixes or matches in a row
  // Before the sub-filter tests are effective (no heading yet, say) a faulty receiver is accepted
  // from the start: the share of the minimum detectable error is capped below the alert limit.
  // While gaps of the INS prevent the tests, an error of any source grows unseen.
  constexpr double kUnseen_mps = 1.0;
  const Duration untested = fault_detection.untested_for(state.belief.x.stamp);
  const double unseen_m =
      kUnseen_mps * seconds(untested) +
      (fused(gps) ? std::min(fault_detection.detectable_m(), 0.8 * limits.limit_horizontal_m)
                  : 0.0);
  const double alternative_m = std::max(excluded(gps) ? fault_detection.alternative_m() : 0.0,
                                        fault_detection.map_alternative_m());
  const Vec3 refuted_m = apart_from_matches(state);
  const UndetectedError undetected = fault_detection.undetected(state.belief.x.stamp);
  if (out.validity == Validity::kWorld && !state.bookkeeping.unconfirmed) {
    out.protection_horizontal_m =
        std::max({refuted_m.head<2>().norm() + kHorizontalQuantile * sigma_h,
                  std::max(unseen_m, alternative_m) + 2.0 * sigma_h, undetected.horizontal_m});
    out.protection_vertical_m =
        std::max(std::abs(refuted_m.z()) + kVerticalQuantile * sigma_v, undetected.vertical_m);
    // Filter or fixes: nobody knows which height is wrong.
    const bool undecided = fused(gps) && state.bookkeeping.heights_undecided &&
                           state.bookkeeping.heights_refused >= kSeveral;
    if (undecided) {
      out.protection_vertical_m =
          std::max(out.protection_vertical_m, state.bookkeeping.height_off_m + 2.0 * sigma_v);
    }
  }

  // Before the first datum there is no claim in frame world, and no alert about it.
  const bool in_world = georeferenced || state.bookkeeping.world_resets > 0;
  if (in_world && out.protection_horizontal_m > limits.limit_horizontal_m) {
    out.alerts |= kAlertHorizontal;
  }
  if (in_world && out.protection_vertical_m > limits.limit_vertical_m) {
    out.alerts |= kAlertVertical;
  }
  if (silent_for > Duration::zero()) out.alerts |= kAlertInput;
  const Bookkeeping& m = state.bookkeeping;
  const bool refuted = m.of(Source::kGpsPosition).refused >= kSeveral ||
                       m.heights_refused >= kSeveral || m.gps_suspected ||
                       fault_detection.gps_test_ratio() > 1.0;
  if (gps != SourceStatus::kNone && refuted) out.alerts |= kAlertGps;
  const bool refused = m.of(Source::kRolling).refused >= kSeveral;
  if (excluded(ladar) || refused || fault_detection.ladar_test_ratio() > 1.0) {
    out.alerts |= kAlertLadar;
  }
  if (excluded(fault_detection.ins(state)) || fault_detection.ins_test_ratio() > 1.0 ||
      untested > Duration::zero()) {
    out.alerts |= kAlertIns;
  }
  if (fault_detection.odometry_excluded(state)) out.alerts |= kAlertOdometry;

  if (out.validity != Validity::kWorld) {
    out.sigma_in_60s_m = std::numeric_limits<double>::infinity();
    out.alert_in_s = 0.0;
    return out;
  }
  out.sigma_in_60s_m = growth.sigma_m(60.0);
  for (double t_s = 0.0; t_s <= kFarthest_s; t_s += 1.0) {
    if (kHorizontalQuantile * growth.sigma_m(t_s) <= limits.limit_horizontal_m) continue;
    out.alert_in_s = t_s;
    break;
  }
  return out;
}

}  // namespace rcs::wm
