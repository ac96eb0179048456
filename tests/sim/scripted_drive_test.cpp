#include "sim/vehicle/scripted_drive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

TEST(Vehicle, StaysLevelOnLevelGround) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  const Trajectory t = drive(course, world, {}, course.duration_s() + 1.0);
  for (double s = 0.0; s < t.duration_s(); s += 0.05) {
    const Motion m = t.at(s);
    EXPECT_NEAR(m.T_world_vehicle.p.z(), 0.9, 1e-9);
    EXPECT_LT((m.T_world_vehicle.q * Vec3::UnitZ() - Vec3::UnitZ()).norm(), 1e-9);
    const Vec3 v_vehicle = m.T_world_vehicle.q.conjugate() * m.v_world;
    EXPECT_LT(std::abs(v_vehicle.y()), 0.02) << s;  // no side slip
  }
}

TEST(Vehicle, RestsThenDrivesTheCourse) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 20.0);
  const Trajectory t = drive(course, world, {}, course.duration_s() + 3.0);
  for (double s = 0.0; s < 2.9; s += 0.1) {
    EXPECT_LT(t.at(s).v_world.norm(), 1e-12);
    EXPECT_LT(t.at(s).rate_vehicle.norm(), 1e-12);
  }
  const Vec3 end = t.pose_at(t.duration_s()).p;
  EXPECT_NEAR(end.x(), 150.0, 1e-3);
  EXPECT_NEAR(end.y(), 40.0, 1e-3);
  for (double s = 0.0; s < t.duration_s(); s += 0.5) {
    const CoursePoint c = course.at_distance(course.distance_at(s));
    EXPECT_LT((t.pose_at(s).p.head<2>() - c.p_world).norm(), 0.01);
  }
}

TEST(Vehicle, FollowsTheGroundWithPitchAndRoll) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 20.0);
  const VehicleParams params;
  const Trajectory t = drive(course, world, params, course.duration_s());
  double tilt2 = 0.0;
  double clearance2 = 0.0;
  int n = 0;
  for (double s = 3.0; s < t.duration_s(); s += 0.05, ++n) {
    const Pose T = t.pose_at(s);
    const double c = T.p.z() - world.height(T.p.x(), T.p.y()) - params.imu_height_m;
    clearance2 += c * c;
    tilt2 += std::pow(std::acos((T.q * Vec3::UnitZ()).z()), 2);
  }
  EXPECT_LT(std::sqrt(clearance2 / n), 0.2);
  EXPECT_GT(degrees(std::sqrt(tilt2 / n)), 3.0);
}

}  // namespace
}  // namespace rcs::sim
