#include "sim/vehicle/course.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

TEST(Course, GoesThroughItsWaypoints) {
  const CourseParams params = s_course();
  const Course course(params);
  for (const Vec2& waypoint : params.waypoints_world) {
    double nearest_m = 1e9;
    for (double s = 0.0; s <= course.length_m(); s += 0.05) {
      nearest_m = std::min(nearest_m, (course.at_distance(s).p_world - waypoint).norm());
    }
    EXPECT_LT(nearest_m, 0.05);
  }
}

TEST(Course, DistanceIsMeasuredAlongIt) {
  const Course course(s_course());
  for (double s = 1.0; s + 0.5 < course.length_m(); s += 3.1) {
    const Vec2 step = course.at_distance(s + 0.5).p_world - course.at_distance(s).p_world;
    EXPECT_NEAR(step.norm(), 0.5, 0.002);
    const double heading = course.at_distance(s + 0.25).heading_rad;
    EXPECT_NEAR(std::abs(wrap_angle(std::atan2(step.y(), step.x()) - heading)), 0.0, 0.005);
  }
}

TEST(Course, StartsAndEndsAtRestAndRespectsItsLimits) {
  CourseParams params = s_course();
  params.lateral_mps2 = 1.0;
  const Course course(params);
  EXPECT_EQ(course.distance_at(2.999), 0.0);
  EXPECT_NEAR(course.distance_at(3.5), 0.5 * 1.5 * 0.25, 1e-3);
  EXPECT_EQ(course.distance_at(course.duration_s() + 5.0), course.length_m());
  const double h = 0.05;
  double fastest = 0.0;
  for (double t = 0.0; t < course.duration_s(); t += 0.1) {
    const double s0 = course.distance_at(t);
    const double s1 = course.distance_at(t + h);
    const double v = (s1 - s0) / h;
    fastest = std::max(fastest, v);
    const double turn = wrap_angle(course.at_distance(s0 + 0.5).heading_rad -
                                   course.at_distance(s0 - 0.5).heading_rad);
    EXPECT_LT(v * v * std::abs(turn), 1.1) << t;  // turn over 1 m is the curvature
    const double a = (course.distance_at(t + 2 * h) - 2 * s1 + s0) / (h * h);
    EXPECT_LT(std::abs(a), 1.55) << t;
  }
  EXPECT_LE(fastest, params.speed_mps + 1e-6);
  EXPECT_GT(fastest, 5.0);
}

}  // namespace
}  // namespace rcs::sim
