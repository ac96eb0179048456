#pragma once
// Response of the vehicle to a drive command, in the plane: a kinematic bicycle with actuators that
// are slow, limited, and stop the vehicle when no command is in force.

#include <cstdint>
#include <vector>

#include "sim/vehicle/course.h"

namespace rcs::sim {

struct DriveParams {
  double speed_max_mps = 15.0;     ///< forward
  double reverse_max_mps = 2.0;    ///< backward
  double acceleration_mps2 = 2.0;  ///< speeding up
  double braking_mps2 = 3.0;       ///< slowing down
  double hard_braking_mps2 = 5.0;  ///< slowing down with the brake command
  double curvature_max_1pm = 0.2;
  double curvature_rate = 0.25;  ///< of the steering [1/(m s)]
  double delay_s = 0.06;         ///< from a command's arrival to its effect
  /// The rear axle steers against the front axle by this share. 1: the origin of the vehicle frame,
  /// between the axles, has no side slip; 0: front steering, with side slip in every turn.
  double rear_steer = 1.0;
};

/// A drive command; times are those of the simulation.
struct DriveCommand {
  double issued_s = 0.0;
  double valid_until_s = 0.0;
  double speed_mps = 0.0;       ///< negative: backward
  double curvature_1pm = 0.0;   ///< of the path of the origin of the vehicle frame; positive left
  double accel_limit_mps2 = 0;  ///< for speeding up, if below that of the vehicle; 0: none
  bool brake = false;           ///< stop as fast as is safe
  /// Brake and stay at rest, also after valid_until_s, until a later command does not have this.
  bool emergency_stop = false;
};

/// Counters of the commands so far.
struct DriveAccount {
  std::int64_t taken = 0;
  std::int64_t implausible = 0;  ///< not finite, out of range, or issued after its arrival
  std::int64_t stale = 0;        ///< not issued after the previous one
  std::int64_t expired = 0;      ///< expired on arrival
  std::int64_t silences = 0;     ///< times that the moving vehicle braked without a valid command
};

/// Deterministic: the motion is a function of the commands and the times of their arrival.
class DriveModel {
 public:
  /// Longest accepted validity: the vehicle must not drive on for long when the commands end.
  static constexpr double kLongest_s = 2.0;

  /// At rest at time 0.
  /// @param wheelbase_m  the axles are half of it before and behind the origin
  DriveModel(const DriveParams& params, double wheelbase_m, const CoursePoint& start);

  /// Accepts a command that has arrived, or rejects it and counts the reason.
  void command(const DriveCommand& command, double arrival_s);
  /// Brakes and accepts no further commands.
  void stop_for_good() { stopped_for_good_ = true; }

  /// Advances to `time_s`, by a short step. A command takes effect delay_s after its arrival.
  void step_to(double time_s);

  /// Position of the vehicle frame and heading of the body, which with side slip is not the course.
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
  /// The command in effect at a time; null: none, and the vehicle brakes.
  const DriveCommand* in_force(double time_s);

  DriveParams params_;
  double slip_m_;  // sine of the side slip per curvature
  double time_s_ = 0.0;
  CoursePoint place_;
  double speed_mps_ = 0.0;
  double curvature_1pm_ = 0.0;
  std::vector<Arrived> arrived_;  // the one in force first, then those not yet in effect
  double newest_issued_s_;
  bool silent_ = true;
  bool stopped_for_good_ = false;
  DriveAccount account_;
};

}  // namespace rcs::sim
