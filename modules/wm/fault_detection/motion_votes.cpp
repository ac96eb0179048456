#include "modules/wm/fault_detection/motion_votes.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/linear.h"

namespace rcs::wm {
namespace {

constexpr Duration kLongestStep = from_seconds(1.5);
// Over which motions are compared.
constexpr Duration kWindow = from_seconds(2.0);
constexpr Duration kLongestWindow = from_seconds(3.0);
// Tolerances of a distance and of a turn, in addition to the standard deviations of the
// registrations. Wheels slip, and climbs lengthen their path; a course is that of the antenna,
// which rocks.
constexpr double kTolerance_m = 0.25;
constexpr double kToleranceShare = 0.05;
constexpr std::array<double, 2> kTolerance_rad = {0.12, 0.045};  // GPS, wheels
constexpr double kSigmas = 3.0;
constexpr double kInsSigmas = 2.0;  // of the velocity of the INS: the test of it contains them, too
// Of the motion across the vehicle's axis: bumps, and sideways slip as a share of the distance.
constexpr double kToleranceAcross_m = 0.15;
constexpr double kToleranceAcrossShare = 0.03;
// Of long turns: the yaw rate of wheels that slip, and the rates of a body that rolls and pitches.
constexpr Duration kTurnWindow = from_seconds(10.0);
constexpr Duration kLongestTurnWindow = from_seconds(12.5);
constexpr Duration kKept = from_seconds(1.0);
constexpr double kTurnTolerance_rad = 0.04;
constexpr double kTurnShare = 0.02;
constexpr double kShortTolerance_rad = 0.025;  // of a turn of five seconds
// GPS and INS contradict each other already: less of the wheels decides.
constexpr double kCourseTolerance_rad = 0.025;
constexpr double kCourseShare = 0.01;
constexpr double kRocking_s = 1.0;  // of the antenna
constexpr Duration kCourseSettles = from_seconds(5.0);
constexpr double kNearer = 0.5;     // to the wheels than the other one: they support it
constexpr double kConfirms = 0.25;  // to the INS, of its distance from the wheels
constexpr double kMaxVotes = 0.5;
constexpr Duration kSuspected = from_seconds(20.0);
constexpr double kPoorRotation = 2.0;         // scale of the errors of a LADAR that is not compared
constexpr double kSlowest_mps = 2.0;          // at which a velocity has a course
constexpr double kLargestSigma_radps = 0.05;  // of a yaw rate that is used
// One sigma of the comparison of the LADAR with the others, over the window.
constexpr double kError_m = 0.25;
constexpr double kErrorShare = 0.01;
constexpr double kError_rad = 0.02;
constexpr double kErrorLowPass = 0.03;  // share of the newest
// Beyond these the LADAR is excluded rather than weighted less.
constexpr double kLargestPosition = 10.0;
constexpr double kLargestRotation = 20.0;
// Sigma of a registration that observes the direction.
constexpr double kObserved_m = 1.0;
constexpr double kObserved_rad = 0.1;
constexpr double kUnknown = 1e9;
constexpr double kShare = 0.2;  // of the newest vote in the low-passed one
constexpr double kSigmaShare = 0.1;

/// The motion from one pose to another: the arc, from the chord.
Motion motion_between(const Pose& from, const Pose& to) {
  const Pose T = from.inverse() * to;
  const double turn_rad = yaw_of(T.q);
  const double half = std::min(std::abs(0.5 * turn_rad), 1.0);
  return {T.p.norm() * (half > 1e-3 ? half / std::sin(half) : 1.0), turn_rad};
}

}  // namespace

Vec2 motion_across(const Pose& from, const Pose& to) {
  const Pose T = from.inverse() * to;
  const Vec3 turn = log_so3(T.q);
  return {T.p.y() - 0.5 * turn.z() * T.p.x(), T.p.z() + 0.5 * turn.y() * T.p.x()};
}

void MotionSum::add(Stamp stamp, double rate) {
  if (newest_ != Stamp::min() && stamp <= newest_) return;
  const bool gap = newest_ == Stamp::min() || stamp - newest_ > kLongestStep;
  if (gap) {
    since_ = stamp;
  } else {
    sum_ += 0.5 * (rate_ + rate) * seconds(stamp - newest_);
  }
  newest_ = stamp;
  rate_ = rate;
}

double MotionSum::at(Stamp stamp) const {
  return newest_ == Stamp::min() ? 0.0 : sum_ + rate_ * seconds(stamp - newest_);
}

Stamp MotionSum::complete_since(Stamp now) const {
  return newest_ != Stamp::min() && now - newest_ <= kLongestStep ? since_ : Stamp::max();
}

void CourseSum::add(Stamp stamp, const Vec3& v_world) {
  if (v_world.head<2>().norm() < kSlowest_mps) return;
  const double course_rad = std::atan2(v_world.y(), v_world.x());
  // The mean rate since the last fix. The sum lags by half of an interval; the tolerance covers it.
  if (stamp_ != Stamp::min() && stamp > stamp_) {
    turn_.add(stamp, wrap_angle(course_rad - course_rad_) / seconds(stamp - stamp_));
  }
  course_rad_ = course_rad;
  stamp_ = stamp;
}

double vote(double by_ins, double by_ladar, double by_reference, double tolerance, double of_ins) {
  const bool ins = std::abs(by_ins - by_reference) <= tolerance + of_ins;
  const bool ladar = std::abs(by_ladar - by_reference) <= tolerance;
  if (ins == ladar || std::abs(by_ins - by_ladar) <= tolerance) return 0.0;
  return ladar ? 1.0 : -1.0;
}

void MotionVotes::add(Stamp stamp, const OdometrySample& z, double wheel_scale, bool accepted) {
  distance_[kWheels].add(stamp, z.speed_mps / wheel_scale);
  const bool turns = std::isfinite(z.yaw_rate_radps);
  if (turns && z.sigma_yaw_rate_radps < kLargestSigma_radps) {
    wheels_turn_.add(stamp, z.yaw_rate_radps);
  }
  if (accepted) return;
  distance_[kWheels].interrupt(stamp);
  wheels_turn_.interrupt(stamp);
}

void MotionVotes::add(Stamp stamp, const GpsFix& z, bool reverse) {
  if (!z.has_velocity) return;
  const double speed_mps = z.v_world.norm();
  distance_[kGps].add(stamp, reverse ? -speed_mps : speed_mps);
  course_.add(stamp, z.v_world);
}

void MotionVotes::add_course(Stamp stamp, const GpsFix& z) {
  if (z.has_velocity) any_course_.add(stamp, z.v_world);
}

/// The sums up to a scan.
MotionVotes::Scan MotionVotes::begin_scan(Stamp stamp, const RollingMatch& z,
                                          const InertialPose& ins, bool in_use) {
  if (z.map_epoch != map_epoch_ || ins.branch != branch_) {
    count_ = 0;
    map_epoch_ = z.map_epoch;
    branch_ = ins.branch;
  }
  Scan now;
  now.stamp = stamp;
  now.T_rolling_vehicle = z.T_rolling_vehicle;
  now.T_world_vehicle = ins.T_world_vehicle;
  now.sigma_ins_mps = ins.sigma_mps;
  for (std::size_t k : {kGps, kWheels}) {
    now.by_reference[k] = {distance_[k].at(stamp), turn(k).at(stamp)};
  }
  compare_turns(count_ > 0 ? &scans_[(count_ - 1) % scans_.size()] : nullptr, now, in_use);
  return now;
}

void MotionVotes::add_turn(Stamp stamp, const RollingMatch& z, const InertialPose& ins,
                           bool in_use) {
  const Scan now = begin_scan(stamp, z, ins, in_use);
  scans_[count_++ % scans_.size()] = now;
}

void MotionVotes::add(Stamp stamp, const RollingMatch& z, const Mat6& covariance,
                      const DriveNoise& drive, const InertialPose& ins, bool constrained) {
  Scan now = begin_scan(stamp, z, ins, true);
  now.variance_m2 = covariance(0, 0);
  now.variance_rad2 = covariance(5, 5);
  now.variance_across_m2 = covariance.diagonal().segment<2>(1);
  sigma_ahead_m_ += kSigmaShare * (std::min(std::sqrt(now.variance_m2), 1.0) - sigma_ahead_m_);
  if (count_ > 0) {
    const Scan& last = scans_[(count_ - 1) % scans_.size()];
    now.across_by_ladar =
        last.across_by_ladar + motion_across(last.T_rolling_vehicle, now.T_rolling_vehicle);
    now.across_by_ins =
        last.across_by_ins + motion_across(last.T_world_vehicle, now.T_world_vehicle);
  }
  for (std::size_t k = 1; k <= std::min(count_, scans_.size()); ++k) {
    const Scan& scan = scans_[(count_ - k) % scans_.size()];
    if (stamp - scan.stamp < kWindow) continue;
    if (stamp - scan.stamp > kLongestWindow) break;
    compare(scan, now, drive);
    if (constrained) compare_across(scan, now);
    break;
  }
  scans_[count_++ % scans_.size()] = now;
}

void MotionVotes::compare(const Scan& begin, const Scan& end, const DriveNoise& drive) {
  const Motion by_ladar = motion_between(begin.T_rolling_vehicle, end.T_rolling_vehicle);
  const Motion by_ins = motion_between(begin.T_world_vehicle, end.T_world_vehicle);
  const double variance_m2 = begin.variance_m2 + end.variance_m2;
  const double variance_rad2 = begin.variance_rad2 + end.variance_rad2;
  const LadarScale scale = ladar_scale();
  double apart_m = kUnknown;  // from the nearer of the references
  double apart_rad = kUnknown;
  for (std::size_t k : {kGps, kWheels}) {
    const auto complete = [&](const MotionSum& sum) {
      return sum.complete_since(end.stamp) <= begin.stamp;
    };
    double newest = 0.0;
    if (complete(distance_[k])) {
      const double driven_m = end.by_reference[k].distance_m - begin.by_reference[k].distance_m;
      const double sign = driven_m < 0.0 ? -1.0 : 1.0;
      const double ins_m = sign * by_ins.distance_m;
      const double ladar_m = sign * by_ladar.distance_m;
      newest = vote(ins_m, ladar_m, driven_m,
                    kTolerance_m + kToleranceShare * std::abs(driven_m) +
                        kSigmas * scale.position * std::sqrt(variance_m2),
                    kInsSigmas * end.sigma_ins_mps * seconds(end.stamp - begin.stamp));
      apart_m = std::min(apart_m, odd_one_out(ladar_m, ins_m, driven_m));
    }
    if (complete(turn(k))) {
      const double turn_rad = end.by_reference[k].turn_rad - begin.by_reference[k].turn_rad;
      if (newest == 0.0) {
        newest = vote(by_ins.turn_rad, by_ladar.turn_rad, turn_rad,
                      kTolerance_rad[k] + kSigmas * scale.rotation * std::sqrt(variance_rad2));
      }
      apart_rad = std::min(apart_rad, odd_one_out(by_ladar.turn_rad, by_ins.turn_rad, turn_rad));
    }
    votes_[k] += kShare * (newest - votes_[k]);
  }
  const double share = kErrorShare * by_ladar.distance_m;
  if (apart_m < kUnknown && variance_m2 < kObserved_m * kObserved_m) {
    errors_m_.add(
        apart_m, kError_m + share,
        variance_m2 + drive.rolling_position * drive.rolling_position * by_ins.distance_m);
  }
  if (apart_rad < kUnknown && variance_rad2 < kObserved_rad * kObserved_rad) {
    errors_rad_.add(apart_rad, kError_rad,
                    variance_rad2 + drive.rolling_angle * drive.rolling_angle * by_ins.distance_m);
  }
}

void MotionVotes::compare_across(const Scan& begin, const Scan& end) {
  const double tolerance_m =
      kToleranceAcross_m +
      kToleranceAcrossShare * (begin.T_world_vehicle.p - end.T_world_vehicle.p).norm();
  const Vec2 by_ins = end.across_by_ins - begin.across_by_ins;
  const Vec2 by_ladar = end.across_by_ladar - begin.across_by_ladar;
  const Vec2 sigma_m =
      ladar_scale().position * (begin.variance_across_m2 + end.variance_across_m2).cwiseSqrt();
  double newest = 0.0;
  for (Eigen::Index axis = 0; axis < 2 && newest == 0.0; ++axis) {
    newest = vote(by_ins[axis], by_ladar[axis], 0.0, tolerance_m + kSigmas * sigma_m[axis],
                  kInsSigmas * end.sigma_ins_mps * seconds(end.stamp - begin.stamp));
  }
  votes_[kConstraint] += kShare * (newest - votes_[kConstraint]);
}

void MotionVotes::compare_turns(const Scan* last, const Scan& now, bool in_use) {
  const auto complete = [&now](const MotionSum& sum, Duration time) {
    return sum.complete_since(now.stamp) < now.stamp - time;
  };
  const bool by_wheels_known = complete(wheels_turn_, kTurnWindow);
  const bool of_ladar = errors_rad_.scale(kLargestRotation) < kPoorRotation;
  const bool of_course = complete(any_course_.turn(), kTurnWindow + kCourseSettles);
  if (last != nullptr) {
    const Quat by_ins = last->T_world_vehicle.q.conjugate() * now.T_world_vehicle.q;
    const Quat by_ladar = last->T_rolling_vehicle.q.conjugate() * now.T_rolling_vehicle.q;
    sum_.by_ins_rad += yaw_of(by_ins);
    sum_.by_ladar_rad += yaw_of(by_ladar);
    gyro_axes_.add(log_so3(by_ins), log_so3(by_ladar));
    sum_.by_wheels_rad += now.by_reference[kWheels].turn_rad - last->by_reference[kWheels].turn_rad;
    const double apart_rad = any_course_.turn().at(now.stamp) - sum_.by_wheels_rad;
    sum_.course_less_wheels_rad += std::min(seconds(now.stamp - last->stamp) / kRocking_s, 1.0) *
                                   (apart_rad - sum_.course_less_wheels_rad);
  }
  sum_.stamp = now.stamp;
  double newest = 0.0;
  double by_course = 0.0;
  double against_ins = 0.0;
  for (std::size_t k = 1; by_wheels_known && k <= std::min(turns_count_, turns_.size()); ++k) {
    const Turns& begin = turns_[(turns_count_ - k) % turns_.size()];
    if (now.stamp - begin.stamp < kTurnWindow) continue;
    if (now.stamp - begin.stamp > kLongestTurnWindow) break;
    const double by_wheels = sum_.by_wheels_rad - begin.by_wheels_rad;
    const double ins = std::abs(sum_.by_ins_rad - begin.by_ins_rad - by_wheels);
    const double ladar = std::abs(sum_.by_ladar_rad - begin.by_ladar_rad - by_wheels);
    const double tolerance = kTurnTolerance_rad + kTurnShare * std::abs(by_wheels);
    const double course = std::abs(sum_.course_less_wheels_rad - begin.course_less_wheels_rad);
    const double course_tolerance = kCourseTolerance_rad + kCourseShare * std::abs(by_wheels);
    if (of_ladar && ins > tolerance && ladar < kNearer * ins) newest = 1.0;
    if (of_ladar && ladar > tolerance && ins < kNearer * ladar) newest = -1.0;
    const double ladar_ins =
        std::abs(sum_.by_ladar_rad - begin.by_ladar_rad - (sum_.by_ins_rad - begin.by_ins_rad));
    if (ins > tolerance && ladar_ins > kConfirms * ins) against_ins = 1.0;
    if (of_course && ins > course_tolerance && course < kNearer * ins) by_course = 1.0;
    break;
  }
  course_turns_ += kShare * (by_course - course_turns_);
  unconfirmed_turns_ += kShare * (against_ins - unconfirmed_turns_);
  long_turns_ += kShare * (newest - long_turns_);
  if (in_use && long_turns_ < -kMaxVotes) suspected_until_ = now.stamp + kSuspected;
  expire(now.stamp, true);
  const Stamp kept = turns_[(turns_count_ + turns_.size() - 1) % turns_.size()].stamp;
  if (turns_count_ > 0 && now.stamp < kept) turns_count_ = 0;  // the clocks have stepped back
  if (turns_count_ == 0 || now.stamp - kept >= kKept) {
    turns_[turns_count_++ % turns_.size()] = sum_;
  }
}

bool MotionVotes::contradict_ins_since(const Turns& begin) const {
  if (wheels_turn_.complete_since(sum_.stamp) > begin.stamp) return false;
  const double by_wheels = sum_.by_wheels_rad - begin.by_wheels_rad;
  const double by_ins = sum_.by_ins_rad - begin.by_ins_rad;
  const double by_ladar = sum_.by_ladar_rad - begin.by_ladar_rad;
  const double off = std::abs(by_ins - by_wheels);
  const double tolerance = kShortTolerance_rad + kTurnShare * std::abs(by_wheels);
  return off > tolerance && std::abs(by_ladar - by_ins) > kConfirms * off;
}

void MotionVotes::expire(Stamp now, bool compared) {
  if (suspected_ && !compared) suspected_until_ = now + kSuspected;
  suspected_ = now < suspected_until_ && now >= suspected_until_ - kSuspected;
}

void LadarErrors::add(double apart, double uncertainty, double claimed_variance) {
  const double beyond = std::max(0.0, apart * apart - uncertainty * uncertainty);
  excess += kErrorLowPass * (beyond - excess);
  claimed += kErrorLowPass * (claimed_variance - claimed);
}

double LadarErrors::scale(double largest) const {
  return claimed > 0.0 ? std::clamp(std::sqrt(excess / claimed), 1.0, largest) : 1.0;
}

double odd_one_out(double by_ladar, double by_ins, double by_reference) {
  const double nearer = std::min(std::abs(by_ladar - by_ins), std::abs(by_ladar - by_reference));
  return std::abs(by_ins - by_reference) < nearer ? nearer : 0.0;
}

LadarScale MotionVotes::ladar_scale() const {
  if (suspected_) return {kLargestPosition, kLargestRotation};
  return {errors_m_.scale(kLargestPosition), errors_rad_.scale(kLargestRotation)};
}

double MotionVotes::verdict() const {
  // Weak votes for one side do not add up: they may have one cause.
  const auto [against_ladar, against_ins] = std::minmax_element(votes_.begin(), votes_.end());
  return std::max(*against_ins, 0.0) + std::min(*against_ladar, 0.0);
}

}  // namespace rcs::wm
