#include "sim/vehicle/scripted_drive.h"

#include <cmath>

namespace rcs::sim {

Trajectory drive(const Course& course, const World& world, const VehicleParams& params,
                 double duration_s) {
  const auto place = [&](double time_s) { return course.at_distance(course.distance_at(time_s)); };
  Suspension body(&world, params, place(0.0));
  // The motion starts at knot 1.
  std::vector<Pose> knots = {body.pose(place(0.0)), body.pose(place(0.0))};
  const int count = static_cast<int>(std::ceil(duration_s / kKnotInterval_s)) + 1;
  for (int k = 1; k <= count; ++k) {
    for (int n = 1; n <= kStepsPerKnot; ++n) {
      body.step(place((k - 1) * kKnotInterval_s + n * Suspension::kStep_s));
    }
    knots.push_back(body.pose(place(k * kKnotInterval_s)));
  }
  return Trajectory(std::move(knots), kKnotInterval_s);
}

}  // namespace rcs::sim
