#pragma once
// What a drive command does to the vehicle, seen from above: a kinematic bicycle behind actuators
// that are slow, limited, and stop the vehicle when nobody commands it.

#include <cstdint>
#include <vector>

#include "sim/vehicle/course.h"

namespace rcs::sim {

struct DriveParams {
  double speed_max_mps = 15.0;     ///< forward
  double reverse_max_mps = 2.0;    ///< backward
  double acceleration_mps2 = 2.0;  ///< speeding up
  double braking_mps2 = 3.0;       ///< slowing down
  double hard_braking_mps2 = 5.0;  ///< the same with the brake
  double curvature_max_1pm = 0.2;
  double curvature_rate = 0.25;  ///< of the steering [1/(m s)]
  double delay_s = 0.06;         ///< from a command's arrival to its effect
  /// The rear axle steers against the front one by this share. 1: the vehicle's frame,
  /// between the axles, does not slip sideways; 0: front steering, and it does in every turn.
  double rear_steer = 1.0;
};

/// A drive command; times are the simulation's.
struct DriveCommand {
  double issued_s = 0.0;
  double valid_until_s = 0.0;
  double speed_mps = 0.0;       ///< negative: backward
  double curvature_1pm = 0.0;   ///< of the path of the vehicle frame's origin; positive left
  double accel_limit_mps2 = 0;  ///< for speeding up, where it is below the vehicle's own; 0: none
  bool brake = false;           ///< stop as fast as is safe
};

/// What became of the commands so far.
struct DriveAccount {
  std::int64_t taken = 0;
  std::int64_t implausible = 0;  ///< not finite, out of range, issued later than it came
  std::int64_t stale = 0;        ///< not issued after the one before
  std::int64_t expired = 0;      ///< over when it came
  std::int64_t silences = 0;     ///< times that the vehicle, moving, braked for want of a command
};

/// Deterministic: the motion is a function of the commands and the times of their arrival.
class DriveModel {
 public:
  /// Longest validity that is believed: a vehicle must not drive on for long when the commands end.
  static constexpr double kLongest_s = 2.0;

  /// At rest at time 0.
  /// @param wheelbase_m  the axles are at half of it before and behind the origin
  DriveModel(const DriveParams& params, double wheelbase_m, const CoursePoint& start);

  /// Takes a command that has arrived, or refuses it and counts why.
  void command(const DriveCommand& command, double arrival_s);
  /// Brakes and takes no commands any more.
  void stop_for_good() { stopped_for_good_ = true; }

  /// Moves on to `time_s`, by a short step. A command acts delay_s after its arrival.
  void step_to(double time_s);

  /// Where the vehicle's frame is, and where the vehicle points (not always where it goes).
  [[nodiscard]] const CoursePoint& place() const { return place_; }
  [[nodiscard]] double speed_mps() const { return speed_mps_; }
  [[nodiscard]] double curvature_1pm() const { return curvature_1pm_; }
  [[nodiscard]] const DriveAccount& account() const { return account_; }

 private:
  struct Arrived {
    DriveCommand command;
    double arrival_s;
  };
  [[nodiscard]] bool plausible(const DriveCommand& c, double arrival_s) const;
  /// What acts at a moment; null: nothing, so the vehicle brakes.
  const DriveCommand* in_force(double time_s);

  DriveParams params_;
  double slip_m_;  // sine of the side slip per curvature
  double time_s_ = 0.0;
  CoursePoint place_;
  double speed_mps_ = 0.0;
  double curvature_1pm_ = 0.0;
  std::vector<Arrived> arrived_;  // the one in force first, then those that do not act yet
  double newest_issued_s_;
  bool silent_ = true;
  bool stopped_for_good_ = false;
  DriveAccount account_;
};

}  // namespace rcs::sim
