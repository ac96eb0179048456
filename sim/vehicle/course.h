#pragma once
// The scripted drive: position of the vehicle along its course as a function of time.

#include <cstdint>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::sim {

struct CourseParams {
  std::vector<Vec2> waypoints_world;  ///< at least two
  double rest_s = 3.0;                ///< at rest before the start
  double speed_mps = 9.72;            ///< top speed (35 km/h)
  double acceleration_mps2 = 1.5;     ///< speeding up and slowing down
  double lateral_mps2 = 3.0;          ///< largest lateral acceleration in turns
};

/// Random waypoints: the heading changes between legs by a uniform angle to either side.
struct RandomCourseParams {
  int count = 5;  ///< of waypoints after the start
  double leg_min_m = 35.0;
  double leg_max_m = 55.0;
  double turn_rad = radians(60.0);  ///< largest, to either side
};

/// The start (0, 0), then `count` waypoints; the direction of the first leg is uniform.
[[nodiscard]] std::vector<Vec2> random_waypoints(const RandomCourseParams& params,
                                                 std::uint64_t seed);

/// A pose on the course in the plane.
struct CoursePoint {
  Vec2 p_world = Vec2::Zero();
  double heading_rad = 0.0;  ///< counter-clockwise from east
};

/// A curve through the waypoints with continuous curvature (natural cubic spline over the chord
/// length), driven from rest to rest.
class Course {
 public:
  explicit Course(const CourseParams& params);

  [[nodiscard]] double length_m() const { return arc_m_.back(); }
  /// Of the drive, including the initial rest.
  [[nodiscard]] double duration_s() const { return moment_s_.back(); }
  /// Arc length at a time; clamped to the drive.
  [[nodiscard]] double distance_at(double time_s) const;
  [[nodiscard]] CoursePoint at_distance(double arc_m) const;
  /// Points along the course, half a metre apart.
  [[nodiscard]] std::vector<Vec2> points() const;

 private:
  void fit(const std::vector<Vec2>& waypoints);
  void schedule(const CourseParams& params);
  [[nodiscard]] double curvature(double u) const;
  void evaluate(double u, Vec2* p, Vec2* dp, Vec2* ddp) const;

  // The spline: knots by chord length, values and second derivatives.
  std::vector<double> knot_;
  std::vector<Vec2> value_;
  std::vector<Vec2> second_;
  // Fine samples: spline parameter, arc length, time.
  std::vector<double> parameter_;
  std::vector<double> arc_m_;
  std::vector<double> speed_mps_;
  std::vector<double> moment_s_;
};

}  // namespace rcs::sim
