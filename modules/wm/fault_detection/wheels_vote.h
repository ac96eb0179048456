#pragma once
// Without INS the wheels are one of three: their distance and turn of the last seconds against
// those by the LADAR, where GPS or the rotation of an excluded INS agrees with the LADAR.

#include <array>
#include <cstddef>

#include "modules/wm/fault_detection/motion_votes.h"
#include "modules/wm/measurement_models.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

class WheelsVote {
 public:
  static constexpr Duration kWindow = from_seconds(2.0);

  void add(Stamp stamp, const OdometrySample& z, double wheel_scale);
  /// Also of a fix that the filter rejects.
  void add(Stamp stamp, const GpsFix& z);
  /// @param by_ins  rotation from an unknown origin, of an INS that is received; otherwise null
  void add(Stamp stamp, const RollingMatch& z, const Quat* by_ins);

  /// The comparison begins here: what was before has not moved the filter.
  void begin();

  /// Two others agree against the wheels.
  [[nodiscard]] bool contradicts() const;
  /// One of them is GPS.
  [[nodiscard]] bool by_fixes() const { return by_fixes_; }
  /// Wheels less LADAR over the last window.
  [[nodiscard]] const Motion& apart() const { return apart_; }
  /// The LADAR, if it is received, does not contradict their turn.
  [[nodiscard]] bool turn_alike(Stamp now) const;

 private:
  struct Scan {
    Stamp stamp = Stamp::min();
    Pose T_rolling_vehicle;
    Motion by_wheels, by_fixes;
    Quat by_ins = Quat::Identity();
    bool ins = false;
  };

  [[nodiscard]] bool compare(const Scan& begin, const Scan& end);

  Stamp from_ = Stamp::min();  // of fixes without velocity: begin of the newest chord
  Vec3 from_m_ = Vec3::Zero();
  MotionSum wheels_distance_, wheels_turn_, fixes_distance_;
  CourseSum course_;
  std::array<Scan, 32> scans_{};
  std::size_t count_ = 0;
  int map_epoch_ = -1;
  double vote_ = 0.0;  // low-passed
  bool by_fixes_ = false;
  Motion apart_;
  Stamp compared_ = Stamp::min();
};

}  // namespace rcs::wm
