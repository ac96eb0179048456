// Fixes that repeat the position of the one before.

#include "lcmtypes/gps_content.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace rcs {
namespace {

/// At 5 Hz, of a vehicle that drives north.
gps_fix_t fix(int k, double lat_deg, double speed_mps, bool has_velocity = true) {
  gps_fix_t m{};
  m.utime = std::int64_t{200'000} * k;
  m.lat_deg = lat_deg;
  m.lon_deg = 8.0;
  m.height_m = 100.0;
  m.has_velocity = has_velocity ? 1 : 0;
  m.v_enu_mps[1] = speed_mps;
  return m;
}

double lat(double north_m) { return 49.0 + north_m / 111'000.0; }

TEST(GpsContent, AStuckReceiverIsRejectedAndReturns) {
  for (const bool has_velocity : {true, false}) {
    GpsContent content;
    EXPECT_TRUE(content.add(fix(0, lat(0.0), 9.0, has_velocity), 9.0));
    EXPECT_TRUE(content.add(fix(1, lat(1.8), 9.0, has_velocity), 9.0));
    int accepted = 0;
    for (int k = 2; k < 50; ++k) {
      accepted += content.add(fix(k, lat(1.8), 9.0, has_velocity), 9.0) ? 1 : 0;
    }
    EXPECT_EQ(accepted, has_velocity ? 0 : 1);
    EXPECT_TRUE(content.add(fix(50, lat(90.0), 9.0, has_velocity), 9.0));
  }
}

TEST(GpsContent, AReceiverAtRestMayRepeatItself) {
  GpsContent content;
  for (int k = 0; k < 500; ++k) EXPECT_TRUE(content.add(fix(k, lat(0.0), 0.0), 0.0));
  GpsContent without_velocity;
  for (int k = 0; k < 500; ++k) {
    EXPECT_TRUE(without_velocity.add(fix(k, lat(0.0), 0.0, false), 0.0));
  }
}

/// A receiver that holds its position at rest, with noisy velocities, and wheels that spin a
/// little.
TEST(GpsContent, NoiseOfTheVelocityIsNoMotion) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.1);
  GpsContent content;
  GpsContent without_velocity;
  for (int k = 0; k < 3000; ++k) {
    gps_fix_t m = fix(k, lat(0.0), noise(random));
    m.v_enu_mps[0] = noise(random);
    m.sigma_v_enu_mps[0] = m.sigma_v_enu_mps[1] = 0.1;
    EXPECT_TRUE(content.add(m, 0.0)) << k;
    EXPECT_TRUE(without_velocity.add(fix(k, lat(0.0), 0.0, false), k < 5 ? 2.0 : 0.0)) << k;
  }
}

TEST(GpsContent, ACoarseResolutionIsNoFault) {
  GpsContent content;
  constexpr double kResolution_m = 0.18;
  for (int k = 0; k < 500; ++k) {
    const double north_m = kResolution_m * std::round(0.06 * k / kResolution_m);
    EXPECT_TRUE(content.add(fix(k, lat(north_m), 0.3), 0.3)) << k;
  }
}

/// A solution of one hertz that is sent five times.
TEST(GpsContent, CopiesOfASolutionAreRejectedWhileTheVehicleMoves) {
  GpsContent content;
  int accepted = 0;
  for (int k = 0; k < 100; ++k) {
    accepted += content.add(fix(k, lat(9.0 * std::floor(0.2 * k)), 9.0), 9.0) ? 1 : 0;
  }
  EXPECT_EQ(accepted, 20);
}

TEST(GpsContent, StampsThatStepAndValuesThatAreNoNumbersAreNoFault) {
  GpsContent content;
  EXPECT_TRUE(content.add(fix(100, lat(0.0), 9.0), 0.0));
  EXPECT_TRUE(content.add(fix(1, lat(0.0), 9.0), 0.0)) << "older";
  gps_fix_t m = fix(2, lat(0.0), std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(content.add(m, 0.0));
  m.lat_deg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(content.add(m, 0.0)) << "WM rejects it as invalid";
}

}  // namespace
}  // namespace rcs
