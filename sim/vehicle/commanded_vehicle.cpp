#include "sim/vehicle/commanded_vehicle.h"

#include "sim/vehicle/scripted_drive.h"

namespace rcs::sim {

CommandedVehicle::CommandedVehicle(const DriveParams& drive, const VehicleParams& params,
                                   const World* world, const CoursePoint& start)
    : world_(world),
      model_(drive, params.wheelbase_m, start),
      body_(world, params, start),
      // Four knots at rest; the second is at time 0.
      steps_(std::int64_t{2} * kStepsPerKnot),
      motion_(std::vector<Pose>(4, body_.pose(start)), kKnotInterval_s) {
  model_.step_to(static_cast<double>(steps_) * Suspension::kStep_s);
}

void CommandedVehicle::go_on_to(double time_s) {
  while (motion_.duration_s() < time_s) {
    for (int n = 0; n < kStepsPerKnot; ++n) {
      model_.step_to(static_cast<double>(++steps_) * Suspension::kStep_s);
      body_.step(model_.place());
    }
    motion_.append(body_.pose(model_.place()));
    const Vec2& p = model_.place().p_world;
    fenced_ = fenced_ || !world_->contains(p.x() - kFence_m, p.y() - kFence_m) ||
              !world_->contains(p.x() + kFence_m, p.y() + kFence_m);
    if (fenced_) model_.stop_for_good();
  }
  motion_.forget_before(time_s - kMemory_s);
}

}  // namespace rcs::sim
