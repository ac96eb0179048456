#pragma once
// A vehicle that goes where drive commands say: its motion is made as time goes on.

#include <cstdint>

#include "sim/vehicle/drive_model.h"
#include "sim/vehicle/suspension.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

class CommandedVehicle {
 public:
  /// The world ends: so far from its border the vehicle brakes and stays.
  static constexpr double kFence_m = 30.0;
  /// A motion's past that can be asked for.
  static constexpr double kMemory_s = 5.0;

  /// @param world  must outlive it; holds `start`, at least kFence_m from its border
  CommandedVehicle(const DriveParams& drive, const VehicleParams& params, const World* world,
                   const CoursePoint& start);

  void command(const DriveCommand& command, double arrival_s) {
    model_.command(command, arrival_s);
  }

  /// Makes the motion as far as `time_s`, which must not step back by more than kMemory_s. A smooth
  /// motion needs to know two knots more, 40 ms: no command acts sooner than that (DriveParams).
  void go_on_to(double time_s);

  [[nodiscard]] const Trajectory& motion() const { return motion_; }
  [[nodiscard]] const DriveModel& model() const { return model_; }
  /// It came to the border of the world.
  [[nodiscard]] bool fenced() const { return fenced_; }

 private:
  const World* world_;
  DriveModel model_;
  Suspension body_;
  std::int64_t steps_ = 0;  // of the suspension
  Trajectory motion_;
  bool fenced_ = false;
};

}  // namespace rcs::sim
