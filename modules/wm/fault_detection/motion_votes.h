#pragma once
// Between INS and LADAR, which contradict each other, the wheels, GPS or the non-holonomic
// constraint decide: the distance and the turn of the last seconds by INS, LADAR, wheels and GPS
// are compared, each computed from its own measurements alone, and the motion by INS and by LADAR
// across the vehicle's own axis, which is small.

#include <array>
#include <cstddef>

#include "modules/wm/fault_detection/gyro_axes.h"
#include "modules/wm/fault_detection/ladar_scale.h"
#include "modules/wm/measurement_models.h"
#include "modules/wm/params.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// What a source that measures distance or turn has summed up.
class MotionSum {
 public:
  /// @param rate  of the distance [m/s] or turn [rad/s]
  void add(Stamp stamp, double rate);
  /// What is measured from here on is another sum.
  void interrupt(Stamp stamp) { since_ = stamp; }
  /// The sum at a stamp not much later than the newest measurement, [m] or [rad].
  [[nodiscard]] double at(Stamp stamp) const;
  /// Since when it has been received without a gap; max(): it is not.
  [[nodiscard]] Stamp complete_since(Stamp now) const;

 private:
  Stamp newest_ = Stamp::min(), since_ = Stamp::max();
  double sum_ = 0.0, rate_ = 0.0;
};

/// The turn by the course of the fixes.
class CourseSum {
 public:
  /// Fixes slower than a walk have no course.
  void add(Stamp stamp, const Vec3& v_world);
  [[nodiscard]] const MotionSum& turn() const { return turn_; }

 private:
  MotionSum turn_;
  double course_rad_ = 0.0;  // of the newest fix
  Stamp stamp_ = Stamp::min();
};

/// Distance ahead and turn to the left.
struct Motion {
  double distance_m = 0.0;
  double turn_rad = 0.0;
};

/// Sideways and upward motion in the axes of the vehicle, between two poses of one scan period: the
/// displacement less that of an arc along the vehicle's own axis [m].
[[nodiscard]] Vec2 motion_across(const Pose& from, const Pose& to);

/// @return 1: the reference agrees with the LADAR and contradicts the INS; -1: the reverse; 0: the
///   reference does not distinguish them
/// @param tolerance  of a difference
/// @param of_ins  added to it for the INS
[[nodiscard]] double vote(double by_ins, double by_ladar, double by_reference, double tolerance,
                          double of_ins = 0.0);

/// Low-passed errors of the LADAR against INS and another source, and the variance that it states.
struct LadarErrors {
  double excess = 0.0;   ///< mean square beyond the uncertainty of the comparison
  double claimed = 0.0;  ///< variance by the registrations and the model of the rolling map

  /// @param apart  difference of the LADAR from the nearer of two others; 0: they do not agree
  /// @param uncertainty  of the comparison, one sigma
  void add(double apart, double uncertainty, double claimed_variance);
  [[nodiscard]] double scale(double largest) const;
};

/// @return difference of `by_ladar` from the nearer of two others that agree better with each other
///   than with the LADAR; otherwise 0
[[nodiscard]] double odd_one_out(double by_ladar, double by_ins, double by_reference);

/// Turns since the begin, from scan to scan, of which one is kept in a second: slow faults of the
/// gyro show over longer times than errors of the registrations do.
struct Turns {
  Stamp stamp = Stamp::min();
  double by_ins_rad = 0.0, by_ladar_rad = 0.0, by_wheels_rad = 0.0;
  double course_less_wheels_rad = 0.0;  ///< low-passed: the antenna rocks
};

/// The pose of the vehicle by the INS alone.
struct InertialPose {
  Pose T_world_vehicle;
  /// When that prediction began: poses of different predictions are not compared.
  Stamp branch = Stamp::min();
  double sigma_mps = 0.0;  ///< of its velocity
};

class MotionVotes {
 public:
  enum Reference : std::size_t { kGps, kWheels };
  static constexpr std::size_t kConstraint = 2;

  /// @param accepted  by a filter; wheels that spin do not vote
  void add(Stamp stamp, const OdometrySample& z, double wheel_scale, bool accepted);
  /// @param reverse  the vehicle drives backwards
  void add(Stamp stamp, const GpsFix& z, bool reverse);
  /// Also of a fix that no filter accepts: GPS is then one of three that are compared.
  void add_course(Stamp stamp, const GpsFix& z);
  /// Call it for each scan that is registered to the rolling map.
  /// @param covariance  of the registration, vehicle axes, (rho, phi)
  /// @param drive  drift of the rolling map
  /// @param constrained  the vehicle moves along its own axis
  void add(Stamp stamp, const RollingMatch& z, const Mat6& covariance, const DriveNoise& drive,
           const InertialPose& ins, bool constrained);
  /// The turns alone, while the INS or its forces are excluded.
  /// @param ins  its rotation from an unknown origin
  /// @param in_use  its rotation is not excluded, and may show that the LADAR is wrong
  void add_turn(Stamp stamp, const RollingMatch& z, const InertialPose& ins, bool in_use);
  /// The distrust of a LADAR ends after a while.
  /// @param compared  with an INS; otherwise it does not end
  void expire(Stamp now, bool compared);
  /// The measured errors of the LADAR stay.
  void reset_votes() {
    votes_ = {};
    long_turns_ = course_turns_ = unconfirmed_turns_ = 0.0;
  }

  /// Above 0 the INS is contradicted, below 0 the LADAR, in [-1, 1]; 0: nobody can tell, or the
  /// references contradict each other.
  [[nodiscard]] double verdict() const;
  /// The same by the turn of the last ten seconds against that of the wheels, for faults too small
  /// for verdict(). A LADAR that it contradicts has the largest scale for 20 s: in high grass it is
  /// wrong again and again.
  [[nodiscard]] double long_turns() const { return long_turns_; }
  /// 1: the wheels contradict the turn by the INS, and the LADAR does not confirm it.
  [[nodiscard]] double unconfirmed_turns() const { return unconfirmed_turns_; }
  /// Axes of the gyro are exchanged or inverted, by the rotation of the LADAR.
  [[nodiscard]] bool gyro_axes_wrong() const { return gyro_axes_.wrong(); }
  /// The gyro rolls or pitches much, and the LADAR not with it.
  [[nodiscard]] bool gyro_unconfirmed() const { return gyro_axes_.unconfirmed(); }
  /// Up to the newest scan.
  [[nodiscard]] const Turns& turns() const { return sum_; }
  /// The wheels contradict the turn by the INS since then, and the LADAR does not confirm it. For
  /// some seconds.
  [[nodiscard]] bool contradict_ins_since(const Turns& begin) const;
  /// The same between INS and GPS: 1: the turns by the wheels and by the course of the fixes agree
  /// against that of the INS. For ground on which the LADAR observes no heading.
  [[nodiscard]] double course_turns() const { return course_turns_; }
  /// Standard deviation of a registration ahead, low-passed [m], at most 1 m: one that determines
  /// little follows its prediction, and confirms nothing.
  [[nodiscard]] double sigma_ahead_m() const { return sigma_ahead_m_; }
  /// Of the LADAR against two other sources that agree with each other.
  [[nodiscard]] LadarScale ladar_scale() const;

 private:
  struct Scan {
    Stamp stamp = Stamp::min();
    Pose T_rolling_vehicle, T_world_vehicle;
    double sigma_ins_mps = 0.0;
    double variance_m2 = 0.0, variance_rad2 = 0.0;  ///< ahead, and about the vertical
    Vec2 variance_across_m2 = Vec2::Zero();
    std::array<Motion, 2> by_reference{};
    /// Sums of motion_across().
    Vec2 across_by_ladar = Vec2::Zero(), across_by_ins = Vec2::Zero();
  };

  Scan begin_scan(Stamp stamp, const RollingMatch& z, const InertialPose& ins, bool in_use);
  void compare(const Scan& begin, const Scan& end, const DriveNoise& drive);
  void compare_across(const Scan& begin, const Scan& end);
  /// @param last  the scan before; null: no motion since is known
  void compare_turns(const Scan* last, const Scan& now, bool in_use);

  [[nodiscard]] const MotionSum& turn(std::size_t reference) const {
    return reference == kGps ? course_.turn() : wheels_turn_;
  }

  std::array<MotionSum, 2> distance_{};
  MotionSum wheels_turn_;
  CourseSum course_, any_course_;  // of accepted fixes, and of all
  std::array<Scan, 32> scans_{};
  std::size_t count_ = 0;
  int map_epoch_ = -1;
  Stamp branch_ = Stamp::min();
  std::array<Turns, 16> turns_{};  // a second apart
  std::size_t turns_count_ = 0;
  Turns sum_;  // up to the newest scan
  std::array<double, 3> votes_{};
  double long_turns_ = 0.0, course_turns_ = 0.0, unconfirmed_turns_ = 0.0;
  Stamp suspected_until_ = Stamp::min();  // of the LADAR, whose long turns were wrong
  bool suspected_ = false;
  LadarErrors errors_m_, errors_rad_;
  double sigma_ahead_m_ = 1.0;
  GyroAxes gyro_axes_;
};

}  // namespace rcs::wm
