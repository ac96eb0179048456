#pragma once
// A vehicle that follows drive commands: its motion is computed as time advances.

#include <cstdint>

#include "sim/vehicle/drive_model.h"
#include "sim/vehicle/suspension.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

class CommandedVehicle {
 public:
  /// Distance from the border of the world at which the vehicle brakes and stays.
  static constexpr double kFence_m = 30.0;
  /// Length of the past motion that can be queried.
  static constexpr double kMemory_s = 5.0;

  /// @param world  must outlive it; contains `start`, at least kFence_m from its border
  CommandedVehicle(const DriveParams& drive, const VehicleParams& params, const World* world,
                   const CoursePoint& start);

  void command(const DriveCommand& command, double arrival_s) {
    model_.command(command, arrival_s);
  }

  /// Computes the motion up to `time_s`, which must not step back by more than kMemory_s. A smooth
  /// motion needs two more knots, 40 ms: no command takes effect sooner than that (DriveParams).
  void go_on_to(double time_s);

  [[nodiscard]] const Trajectory& motion() const { return motion_; }
  [[nodiscard]] const DriveModel& model() const { return model_; }
  /// The vehicle has reached the border of the world.
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
