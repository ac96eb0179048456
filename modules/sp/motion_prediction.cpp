#include "modules/sp/motion_prediction.h"

#include <algorithm>
#include <cmath>

namespace rcs::sp {
namespace {

// With a newest inertial sample older than this, the prediction does not use the INS.
constexpr Duration kInertialGap = from_milliseconds(60.0);
// Time after a gap of the INS within which the motion is less certain.
constexpr Duration kGapLasts = from_milliseconds(500.0);
// A motion is not extrapolated further: one of the stamps is wrong.
constexpr Duration kMotionLasts = from_seconds(2.0);
// After a longer time without a registered pose, the last motion does not predict the position.
constexpr Duration kPoseLasts = from_milliseconds(500.0);
// A vehicle without INS: the motion between two scans is searched.
constexpr Duration kPoseLastsByScans = from_milliseconds(1100.0);
// Of a vehicle, or of a hand: after 0.26 s a registration may begin in the wrong place.
constexpr double kAcceleration_mps2 = 3.0;
constexpr double kCorrected_m = 0.1;
// No vehicle moves faster: two of the stamps are too close to one another.
constexpr double kFastest_mps = 200.0;
constexpr double kFastest_radps = 35.0;

bool has_gap(const InertialBuffer& inertial, Stamp reference) {
  for (std::size_t i = inertial.size() - 1; i > 0; --i) {
    const InertialSample& later = inertial[i];
    if (later.stamp < reference - kGapLasts) return false;
    const Duration gap = later.stamp - later.interval - inertial[i - 1].stamp;
    if (gap > std::max(kInertialGap, 3 * later.interval)) return true;
  }
  return false;
}

bool possible(const Vec6& twist) {
  return twist.allFinite() && twist.head<3>().cwiseAbs().maxCoeff() <= kFastest_mps &&
         twist.tail<3>().cwiseAbs().maxCoeff() <= kFastest_radps;
}

}  // namespace

bool ins_is_silent(const InertialBuffer& inertial, Stamp reference) {
  const InertialSample& newest = inertial[inertial.size() - 1];
  const Duration silence = reference - newest.stamp;
  return silence > std::max(kInertialGap, 3 * newest.interval);
}

Mat6 isotropic(double sigma_m, double sigma_rad) {
  Vec6 d;
  d << Vec3::Constant(sigma_m * sigma_m), Vec3::Constant(sigma_rad * sigma_rad);
  return d.asDiagonal();
}

void MotionGuess::believe(const std::optional<MotionState>& belief, const Mat6& covariance) {
  belief_ = belief;
  belief_covariance_ = covariance;
}

void MotionGuess::remember(Stamp stamp, const Pose& T_rolling_vehicle) {
  before_last_ = stamp > last_.stamp ? last_ : Fix{};  // no velocity after a clock steps back
  last_ = {stamp, T_rolling_vehicle};
}

void MotionGuess::forget_poses() { last_ = before_last_ = {}; }

std::optional<MotionState> MotionGuess::motion_to(Stamp stamp,
                                                  const Pose& T_rolling_vehicle) const {
  if (last_.stamp == Stamp::min() || stamp <= last_.stamp || stamp - last_.stamp > kPoseLasts) {
    return std::nullopt;
  }
  const Vec6 twist =
      log_se3(last_.T_rolling_vehicle.inverse() * T_rolling_vehicle) / seconds(stamp - last_.stamp);
  if (!possible(twist)) return std::nullopt;
  MotionState s;
  s.stamp = stamp;
  s.T_rolling_vehicle = T_rolling_vehicle;
  s.v_rolling = T_rolling_vehicle.q * twist.head<3>();
  s.rate_vehicle_radps = twist.tail<3>();
  return s;
}

/// At the last registered scan, from the one before.
std::optional<MotionState> MotionGuess::own_motion() const {
  if (before_last_.stamp == Stamp::min()) return std::nullopt;
  const double dt = seconds(last_.stamp - before_last_.stamp);
  const Pose moved = before_last_.T_rolling_vehicle.inverse() * last_.T_rolling_vehicle;
  const Vec6 twist = log_se3(moved) / dt;
  if (!possible(twist)) return std::nullopt;
  MotionState s;
  s.stamp = last_.stamp;
  s.T_rolling_vehicle = last_.T_rolling_vehicle;
  s.v_rolling = last_.T_rolling_vehicle.q * twist.head<3>();
  s.rate_vehicle_radps = twist.tail<3>();
  return s;
}

std::optional<Pose> MotionGuess::continued(Stamp reference) const {
  const std::optional<MotionState> last = own_motion();
  if (!last || reference < last_.stamp || reference - last_.stamp > kPoseLasts) return std::nullopt;
  return coast(*last, reference).T_rolling_vehicle;
}

Expectation MotionGuess::expect(Stamp reference, const InertialBuffer& inertial,
                                const ExpectationParams& params) const {
  Expectation e;
  if (inertial.size() > 0) {
    const bool gone = ins_is_silent(inertial, reference);
    e.ins_returned = !gone && has_gap(inertial, reference);
    e.ins_lost = gone || e.ins_returned;
  }
  const bool inertial_covers =
      inertial.size() > 0 && inertial[inertial.size() - 1].stamp >= reference - kInertialGap;
  const auto lasts = [reference](Stamp stamp) {
    return reference - stamp <= kMotionLasts && stamp - reference <= kMotionLasts;
  };
  if (belief_ && inertial_covers && lasts(belief_->stamp)) {
    e.by_belief = true;
    e.at_reference = propagate(*belief_, inertial, reference);
    const double dt = std::abs(seconds(reference - belief_->stamp));
    e.covariance = params.sigma_scale * params.sigma_scale *
                   (belief_covariance_ + isotropic(0.01 + 0.1 * dt, 0.001 + 0.01 * dt));
    return e;
  }
  const Duration pose_lasts = inertial.size() > 0 ? kPoseLasts : kPoseLastsByScans;
  const bool recent = last_.stamp == Stamp::min() || reference - last_.stamp <= pose_lasts;
  if ((!recent || e.ins_lost) && belief_ && lasts(belief_->stamp)) {
    e.by_belief = true;
    e.at_reference = propagate(*belief_, inertial, reference);
    e.covariance = belief_covariance_ + isotropic(params.coast_sigma_m, params.coast_sigma_rad);
    return e;
  }
  e.known = recent;
  // Constant velocity: the last motion continues.
  e.covariance = isotropic(params.coast_sigma_m, params.coast_sigma_rad);
  e.at_reference.stamp = reference;
  e.at_reference.T_rolling_vehicle = last_.T_rolling_vehicle;
  const std::optional<MotionState> last = own_motion();
  if (last && lasts(last_.stamp)) e.at_reference = coast(*last, reference);
  e.by_scans = recent && inertial.size() == 0 && last_.stamp != Stamp::min();
  if (e.by_scans) {
    const double dt = seconds(reference - last_.stamp);
    e.motion_unknown = !last || 0.5 * kAcceleration_mps2 * dt * dt > kCorrected_m;
  }
  return e;
}

}  // namespace rcs::sp
