// An INS that is excluded: what the filter continues with, how its rotation is followed, and the
// hypothesis that it is right again.
#include <algorithm>
#include <cmath>

#include "modules/wm/alignment.h"
#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr int kGyroRefused = 5;  // matches in a row, while the rotation alone is used
constexpr Duration kExcludedFor = from_seconds(1.0);  // before a readmission is considered
constexpr double kSame2 = 9.21;                       // chi-square, 99 %, 2 dof and 1 dof
constexpr double kSame1 = 6.63;
constexpr double kSameHeading_rad = 0.035;  // since the comparison began
constexpr int kAgreeing = 10;               // measurements that readmit the INS, at least
constexpr int kShareAgreeing = 9;           // accepted ones for each rejected one
// Added to the sigma of the biases of a readmitted INS: at first those from before the fault are
// right again. A fault that lasts may be another bias.
constexpr Duration kOtherBiases = from_seconds(15.0);
constexpr double kSameGyro_radps = 0.0005;
constexpr double kSameAccel_mps2 = 0.02;
constexpr double kOtherGyro_radps = 0.02;
constexpr double kOtherAccel_mps2 = 0.3;

}  // namespace

/// The youngest one that branched before the fault can have had an effect.
const Subfilter& FaultDetection::without_ins_since_the_fault() const {
  const auto& [newest, second, third] = without_ins_recent_;
  for (const Subfilter* candidate : {&newest, &second, &third, &without_ins_young_}) {
    const bool before = candidate->alive() && ins_quiet_ != Stamp::min() &&
                        candidate->branch <= ins_quiet_ - kBefore;
    if (before) return *candidate;
  }
  return without_ins_;
}

FilterState FaultDetection::exclude_ins(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  // A rotation that is wrong, too, has spoilt the younger ones.
  const bool in_part_before = belief.bookkeeping.excluded.force;
  // GPS was excluded for contradicting the filter of which the INS is now known to be wrong.
  const bool fixes_are_right =
      gps_is_right(now) || (accepts_fixes(keeps_gps_) && keeps_gps_.agreed >= kHeldFixes);
  FilterState next = fixes_are_right  ? keeps_gps_.state
                     : in_part_before ? without_ins_.state
                                      : without_ins_since_the_fault().state;
  next.bookkeeping.excluded = belief.bookkeeping.excluded;
  if (fixes_are_right) next.bookkeeping.excluded.gps = false;
  // Likewise without that filter, soon after.
  const Stamp fix = next.bookkeeping.of(Source::kGpsPosition).accepted;
  if (belief.bookkeeping.gps_suspected && fix > now - kConsequence) {
    next.bookkeeping.excluded.gps = next.bookkeeping.gps_suspected = false;
    next.bookkeeping.of(Source::kGpsPosition).refused = 0;
  }
  // Likewise the LADAR.
  if (belief.bookkeeping.excluded.ladar && monitors_.ladar.excluded() > now - kConsequence) {
    next.bookkeeping.excluded.ladar = false;
    next.bookkeeping.of(Source::kRolling).refused = 0;
  }
  monitors_.ins.exclude(now);
  next.bookkeeping.excluded.force = !in_part_before && !fixes_are_right && gyro_is_right(now);
  next.bookkeeping.excluded.ins = !next.bookkeeping.excluded.force;
  // The sub-filter has not used it: no gap begins.
  if (next.bookkeeping.excluded.force) next.bookkeeping.ins_stamp = next.belief.x.stamp;
  return found(Finding::kInsFaulty, next, belief, modes);
}

/// Matches and fixes are independent of each other, and the filter rejects both before any
/// sub-filter has branched.
bool FaultDetection::ins_is_faulty_from_the_start(const FilterState& belief) const {
  constexpr int kInRow = 3;
  const Bookkeeping& m = belief.bookkeeping;
  const bool map_moved =
      m.rejected_matches.reset > belief.belief.x.stamp - RejectedMatches::kResetLasts;
  return !branched_ && uses_forces(belief) &&
         (map_moved || m.of(Source::kRolling).refused >= kInRow);
}

/// The INS is faulty before any sub-filter without it has branched, and has spoilt place, heading
/// and velocity: the filter begins again without it.
FilterState FaultDetection::exclude_early_ins(const Model& model, const FilterState& belief) {
  FilterState next = belief;
  next.bookkeeping.excluded.ins = true;
  begin_again(model.params, &next);
  monitors_.ins.exclude(belief.belief.x.stamp);
  return found(Finding::kInsFaulty, next, belief, model.params.modes);
}

void FaultDetection::suppose_ins_right(const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  ins_right_ = {belief, now, belief.bookkeeping.distance_m};
  turns_of_ins_right_ = votes_.turns();
  FilterState& s = ins_right_.state;
  s.bookkeeping.excluded.ins = s.bookkeeping.excluded.force = false;
  s.bookkeeping.ins_stamp = now;
  const bool other = now - monitors_.ins.excluded() > kOtherBiases;
  const double gyro_radps = other ? kOtherGyro_radps : kSameGyro_radps;
  const double accel_mps2 = other ? kOtherAccel_mps2 : kSameAccel_mps2;
  s.belief.P.diagonal().segment<3>(kGyroBias).array() += gyro_radps * gyro_radps;
  s.belief.P.diagonal().segment<3>(kAccelBias).array() += accel_mps2 * accel_mps2;
}

/// The hypothesis that the INS is right again.
std::optional<FilterState> FaultDetection::decide_excluded_ins(const Measurement& m,
                                                               const FilterState& belief,
                                                               const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  if (monitors_.ins.excluded() == Stamp::min()) {  // the filter has been restarted since
    monitors_.ins.exclude(now);
  }
  // The rotation is wrong, too.
  const bool contradicted = belief.bookkeeping.excluded.force && without_ins_.alive() &&
                            now - without_ins_.branch >= kYoung &&
                            (belief.bookkeeping.of(Source::kRolling).refused >= kGyroRefused ||
                             votes_.gyro_axes_wrong() || votes_.gyro_unconfirmed() ||
                             votes_.unconfirmed_turns() > kMajority);
  if (contradicted) {
    FilterState next = without_ins_.state;
    next.bookkeeping.excluded = belief.bookkeeping.excluded;
    next.bookkeeping.excluded.force = false;
    next.bookkeeping.excluded.ins = true;
    return found(Finding::kInsFaulty, next, belief, modes);
  }
  if (!ins_right_.alive()) {
    if (m.imu() == nullptr || now - monitors_.ins.excluded() < kExcludedFor) return std::nullopt;
    suppose_ins_right(belief);
    return std::nullopt;
  }
  const bool long_enough =
      now - ins_right_.began >= monitors_.ins.wait() && ins_right_.agreed >= kAgreeing &&
      ins_right_.agreed >= kShareAgreeing * ins_right_.refused && ins_right_.refused_in_row == 0;
  if (!long_enough || !ins_right_.state.belief.x.inertial) {
    const bool began_during_the_fault = now - ins_right_.began > 2 * monitors_.ins.wait();
    if (began_during_the_fault) ins_right_ = {};
    return std::nullopt;
  }
  // A filter without INS and wheels is so uncertain that it agrees with every heading.
  const double turned_rad = log_so3(belief.belief.x.T_world_vehicle.q.conjugate() *
                                    ins_right_.state.belief.x.T_world_vehicle.q)
                                .norm();
  // With the gyro the filter knows its tilt: forces that change it are wrong.
  const bool confirmed =
      (uses_wheels(belief) || turned_rad < kSameHeading_rad) &&
      (!belief.bookkeeping.excluded.force || tilt_difference(belief, ins_right_.state) <= kSame2);
  // A false readmission is worse than a late one.
  if (difference(belief, ins_right_.state, params_.floor_m) > kSame2 ||
      heading_difference(belief, ins_right_.state) > kSame1 ||
      height_difference(belief, ins_right_.state, params_.floor_m) > kSame1 ||
      votes_.contradict_ins_since(turns_of_ins_right_) || votes_.gyro_axes_wrong() || !confirmed) {
    ins_right_ = {};
    return std::nullopt;
  }
  monitors_.ins.readmit(now);
  return found(Finding::kInsReadmitted, ins_right_.state, belief, modes);
}

/// The rotation by an excluded INS against wheels and LADAR.
void FaultDetection::follow_rotation(const Measurement& m, const FilterState& belief) {
  const NavState& x = belief.belief.x;
  if (const ImuSample* imu = m.imu()) {
    const Vec3 turned = imu->delta_angle - seconds(imu->interval) * x.gyro_bias;
    rotation_ = (rotation_ * exp_so3(turned)).normalized();
    rotated_ = m.stamp;
  } else if (const auto* wheels = std::get_if<OdometrySample>(&m.value)) {
    const bool accepted = belief.bookkeeping.of(Source::kOdometry).accepted == m.stamp;
    votes_.add(m.stamp, *wheels, x.wheel_scale, accepted);
  } else if (const auto* z = std::get_if<RollingMatch>(&m.value)) {
    votes_.add_turn(m.stamp, *z, {Pose{rotation_, Vec3::Zero()}, monitors_.ins.excluded(), 0.0},
                    !belief.bookkeeping.excluded.ins);
  }
}

}  // namespace rcs::wm
