#include "sim/vehicle/commanded_vehicle.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/vehicle/scripted_drive.h"
#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

const std::vector<Vec2> kPlaces = {{0.0, 0.0}, {100.0, 0.0}};

/// Advances to a time in steps of the sensors, commanded 20 times a second.
void drive_on(CommandedVehicle* vehicle, double from_s, double to_s, double speed_mps,
              double curvature_1pm) {
  const int first = static_cast<int>(std::lround(100.0 * from_s));
  const int last = static_cast<int>(std::lround(100.0 * to_s));
  for (int k = first; k < last; ++k) {
    const double time_s = 0.01 * k;
    if (k % 5 == 0) {
      DriveCommand c;
      c.issued_s = time_s;
      c.valid_until_s = time_s + 0.2;
      c.speed_mps = speed_mps;
      c.curvature_1pm = curvature_1pm;
      vehicle->command(c, time_s);
    }
    vehicle->go_on_to(time_s + 0.01);
  }
}

TEST(CommandedVehicle, StandsWhereItStarts) {
  const World world(bare_hills(), {}, kPlaces, 100.0);
  const CoursePoint start{Vec2(3.0, 4.0), 0.5};
  CommandedVehicle vehicle({}, {}, &world, start);
  vehicle.go_on_to(10.0);
  for (double t = 5.0; t < 10.0; t += 0.1) {
    const Motion m = vehicle.motion().at(t);
    EXPECT_LT((m.T_world_vehicle.p.head<2>() - start.p_world).norm(), 1e-12);
    EXPECT_LT(m.v_world.norm(), 1e-9);
    EXPECT_LT(m.rate_vehicle.norm(), 1e-9);
  }
}

TEST(CommandedVehicle, FollowsTheGroundAsTheScriptedDriveDoes) {
  const World world(bare_hills(), {}, kPlaces, 100.0);
  const VehicleParams params;
  CommandedVehicle vehicle({}, params, &world, {});
  drive_on(&vehicle, 0.0, 12.0, 6.0, 0.02);
  double clearance2 = 0.0;
  double tilt2 = 0.0;
  int n = 0;
  for (double t = 7.5; t < 12.0; t += 0.05, ++n) {
    const Motion m = vehicle.motion().at(t);
    const Pose& T = m.T_world_vehicle;
    const double c = T.p.z() - world.height(T.p.x(), T.p.y()) - params.imu_height_m;
    clearance2 += c * c;
    tilt2 += std::pow(std::acos((T.q * Vec3::UnitZ()).z()), 2);
    EXPECT_LT(std::abs((T.q.conjugate() * m.v_world).y()), 0.05);  // no side slip
  }
  EXPECT_LT(std::sqrt(clearance2 / n), 0.2);
  EXPECT_GT(degrees(std::sqrt(tilt2 / n)), 3.0);
  EXPECT_NEAR(vehicle.model().speed_mps(), 6.0, 1e-9);
}

// Later commands must not change past sensor measurements.
TEST(CommandedVehicle, CommandsDoNotChangeThePast) {
  const World world(bare_hills(), {}, kPlaces, 100.0);
  CommandedVehicle a({}, {}, &world, {});
  CommandedVehicle b({}, {}, &world, {});
  drive_on(&a, 0.0, 4.0, 5.0, 0.05);
  drive_on(&b, 0.0, 4.0, 5.0, 0.05);
  drive_on(&b, 4.0, 5.0, 0.0, -0.05);
  for (double t = 0.5; t <= 4.0; t += 0.01) {
    EXPECT_EQ(a.motion().pose_at(t).p, b.motion().pose_at(t).p);
  }
  drive_on(&a, 4.0, 5.0, 5.0, 0.05);
  EXPECT_GT((a.motion().pose_at(5.0).p - b.motion().pose_at(5.0).p).norm(), 0.3);
}

TEST(CommandedVehicle, StopsBeforeTheEndOfTheWorld) {
  const World world(flat_world(), {}, {{0.0, 0.0}}, 60.0);
  CommandedVehicle vehicle({}, {}, &world, {});
  drive_on(&vehicle, 0.0, 30.0, 10.0, 0.0);
  EXPECT_TRUE(vehicle.fenced());
  EXPECT_EQ(vehicle.model().speed_mps(), 0.0);
  EXPECT_GT(vehicle.model().place().p_world.x(), 30.0);
  EXPECT_LT(vehicle.model().place().p_world.x(), 60.0);
}

TEST(CommandedVehicle, AnHourOfDrivingNeedsNoMoreMemoryThanAMinute) {
  const World world(flat_world(), {}, {{0.0, 0.0}}, 60.0);
  CommandedVehicle vehicle({}, {}, &world, {});
  std::size_t most = 0;
  for (int k = 0; k < 60; ++k) {
    drive_on(&vehicle, 60.0 * k, 60.0 * (k + 1), 3.0, 0.1);
    most = std::max(most, vehicle.motion().knots_kept());
  }
  EXPECT_LE(most, 2 * static_cast<std::size_t>(CommandedVehicle::kMemory_s / kKnotInterval_s) + 10);
}

}  // namespace
}  // namespace rcs::sim
