#include "sim/sensors/gps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

const Geodetic kDatum{radians(40.43), radians(-76.57), {150.0}};

Trajectory at_rest() {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  return drive(course, world, {}, 2.0);
}

TEST(Gps, ErrorIsGaussMarkov) {
  const Trajectory vehicle = at_rest();
  const LocalFrame frame(kDatum);
  const GpsParams params;
  const Vec3 truth = vehicle.pose_at(0.0) * params.p_vehicle_antenna;
  double variance = 0.0;
  double covariance = 0.0;  // over 60 s
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    GpsReceiver receiver(params, kDatum, seed);
    GpsFix fix;
    Vec3 first = Vec3::Zero();
    for (int k = 1; k <= 301; ++k) {
      ASSERT_TRUE(receiver.measure(vehicle, 0.2 * k, &fix));
      const Vec3 error = frame.to_world(fix.antenna) - truth;
      if (k == 1) first = error;
      if (k == 301) {
        variance += 0.5 * (first.squaredNorm() + error.squaredNorm());
        covariance += first.dot(error);
        n += 3;
      }
    }
  }
  // 600 pairs: three sigma of the variance is 15 %.
  EXPECT_NEAR(variance / n / (0.09 + 0.0004), 1.0, 0.15);
  EXPECT_NEAR(covariance / variance, std::exp(-1.0), 0.13);
}

TEST(Gps, WithoutNoiseItIsTheAntennaPosition) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, 12.0);
  GpsParams params;
  params.sigma_m = 0.0;
  params.white_m = 0.0;
  params.sigma_v_mps = 0.0;
  GpsReceiver receiver(params, kDatum, 1);
  const LocalFrame frame(kDatum);
  const double h = 1e-4;
  for (int k = 1; k < 59; ++k) {
    GpsFix fix;
    const double t = 0.2 * k;
    ASSERT_TRUE(receiver.measure(vehicle, t, &fix));
    const Vec3 p = vehicle.pose_at(t) * params.p_vehicle_antenna;
    EXPECT_LT((frame.to_world(fix.antenna) - p).norm(), 1e-6);
    const Vec3 v = (vehicle.pose_at(t + h) * params.p_vehicle_antenna -
                    vehicle.pose_at(t - h) * params.p_vehicle_antenna) /
                   (2 * h);
    EXPECT_LT((fix.v_world - v).norm(), 1e-3);
  }
}

TEST(Gps, OutagesDoNotChangeLaterFixes) {
  const Trajectory vehicle = at_rest();
  GpsParams cut;
  cut.outages = {{10.0, 5.0}};
  GpsReceiver a({}, kDatum, 3);
  GpsReceiver b(cut, kDatum, 3);
  int missing = 0;
  for (int k = 1; k <= 150; ++k) {
    GpsFix x, y;
    ASSERT_TRUE(a.measure(vehicle, 0.2 * k, &x));
    if (!b.measure(vehicle, 0.2 * k, &y)) {
      ++missing;
      continue;
    }
    EXPECT_EQ(x.antenna.lat_rad, y.antenna.lat_rad);
  }
  EXPECT_EQ(missing, 25);
}

}  // namespace
}  // namespace rcs::sim
