// Sensor messages of ROS 2 as messages of this system: values, units, invalid input, and that they
// undo sensor_messages.h.

#include "rcs/ros2/sensor_input.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rcs/ros2/sensor_messages.h"

namespace rcs::ros2 {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Vec3 kSigma_m(5.0, 5.0, 10.0);

TEST(UtcOf, RejectsInvalidStamps) {
  EXPECT_EQ(utc_of({5, 1'999}), 5'000'001);
  EXPECT_FALSE(utc_of({-1, 0}).has_value());
  EXPECT_FALSE(utc_of({5, 1'000'000'000}).has_value());
}

TEST(ToIns, UndoesToImu) {
  ins_t ours{};
  ours.utime = 7'000'000;
  ours.interval_us = 5000;
  ours.valid = 1;
  ours.delta_angle_rad[2] = 0.001;
  ours.delta_v_mps[0] = 0.01;
  ours.delta_v_mps[2] = 0.049;
  const auto imu = to_imu(ours, {});
  ASSERT_TRUE(imu.has_value());
  const auto back = to_ins(*imu, ours.utime, Duration(ours.interval_us), Quat::Identity());
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->utime, ours.utime);
  EXPECT_EQ(back->interval_us, ours.interval_us);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(back->delta_angle_rad[i], ours.delta_angle_rad[i], 1e-15);
    EXPECT_NEAR(back->delta_v_mps[i], ours.delta_v_mps[i], 1e-15);
  }
}

TEST(ToIns, RejectsWhatNoVehicleMeasures) {
  const auto valid = [](double rate_radps, double force_mps2, double interval_s) {
    msg::Imu m;
    m.angular_velocity.y = rate_radps;
    m.linear_acceleration.z = force_mps2;
    return to_ins(m, 0, from_seconds(interval_s), Quat::Identity()).has_value();
  };
  EXPECT_TRUE(valid(1.0, 9.81, 0.01));
  EXPECT_FALSE(valid(kNan, 9.81, 0.01));
  EXPECT_FALSE(valid(1.0, 1e300, 0.01));
  EXPECT_FALSE(valid(50.0, 9.81, 0.01));
  EXPECT_FALSE(valid(1.0, 9.81, 0.0));
  EXPECT_FALSE(valid(1.0, 9.81, -0.01));
  EXPECT_FALSE(valid(1.0, 9.81, 0.6));
}

TEST(ToGpsFix, UndoesToNavSatFix) {
  gps_fix_t ours{};
  ours.utime = 5'000'000;
  ours.lat_deg = 39.1;
  ours.lon_deg = -77.2;
  ours.height_m = 120.0;
  ours.height_kind = gps_fix_t::HEIGHT_ELLIPSOIDAL;
  ours.fix_type = gps_fix_t::FIX_DIFFERENTIAL;
  ours.sigma_enu_m[0] = 0.5;
  ours.sigma_enu_m[1] = 0.6;
  ours.sigma_enu_m[2] = 1.2;
  const auto fix = to_nav_sat_fix(ours, {});
  ASSERT_TRUE(fix.has_value());
  const auto back = to_gps_fix(*fix, ours.utime, kSigma_m);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->lat_deg, ours.lat_deg);
  EXPECT_EQ(back->lon_deg, ours.lon_deg);
  EXPECT_EQ(back->height_m, ours.height_m);
  EXPECT_EQ(back->height_kind, ours.height_kind);
  EXPECT_EQ(back->fix_type, ours.fix_type);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(back->sigma_enu_m[i], ours.sigma_enu_m[i], 1e-12);
  EXPECT_EQ(back->has_velocity, 0);
  EXPECT_EQ(back->satellites, 0) << "not reported";
}

TEST(ToGpsFix, StatusCovarianceAndPositionAreChecked) {
  msg::NavSatFix m;
  m.latitude = 39.0;
  m.longitude = -77.0;
  m.altitude = 100.0;
  EXPECT_EQ(to_gps_fix(m, 0, kSigma_m)->sigma_enu_m[2], 10.0) << "the covariance is unknown";
  m.position_covariance_type = 3;
  m.position_covariance = {4.0, 0.0, 0.0, 0.0, kNan, 0.0, 0.0, 0.0, -1.0};
  const auto fix = to_gps_fix(m, 0, kSigma_m);
  EXPECT_EQ(fix->sigma_enu_m[0], 2.0);
  EXPECT_EQ(fix->sigma_enu_m[1], 5.0);
  EXPECT_EQ(fix->sigma_enu_m[2], 10.0);
  m.status.status = 2;
  EXPECT_EQ(to_gps_fix(m, 0, kSigma_m)->fix_type, +gps_fix_t::FIX_FLOAT);
  m.altitude = kNan;
  EXPECT_FALSE(to_gps_fix(m, 0, kSigma_m).has_value()) << "an unknown height";
  m.altitude = 100.0;
  m.latitude = 91.0;
  EXPECT_FALSE(to_gps_fix(m, 0, kSigma_m).has_value());
  m.status.status = -1;
  EXPECT_EQ(to_gps_fix(m, 0, kSigma_m)->fix_type, +gps_fix_t::FIX_NONE);
  m.status.status = 77;
  EXPECT_EQ(to_gps_fix(m, 0, kSigma_m)->fix_type, +gps_fix_t::FIX_NONE);
}

TEST(ToOdometry, SpeedAndYawRateWithTheirVariances) {
  msg::Odometry m;
  m.twist.twist.linear.x = -2.0;
  m.twist.twist.angular.z = 0.1;
  m.twist.covariance[0] = 0.04;
  auto z = to_odometry(m, 9, Duration(50'000), 0.3);
  ASSERT_TRUE(z.has_value());
  EXPECT_EQ(z->utime, 9);
  EXPECT_EQ(z->interval_us, 50'000);
  EXPECT_EQ(z->speed_mps, -2.0);
  EXPECT_NEAR(z->sigma_speed_mps, 0.2, 1e-15);
  EXPECT_TRUE(std::isnan(z->yaw_rate_radps)) << "a yaw rate without a variance";
  m.twist.covariance[0] = 0.0;
  m.twist.covariance[35] = 0.01;
  z = to_odometry(m, 9, Duration(2'000'000), 0.3);
  EXPECT_EQ(z->interval_us, 0) << "a gap";
  EXPECT_EQ(z->sigma_speed_mps, 0.3);
  EXPECT_EQ(z->yaw_rate_radps, 0.1);
  EXPECT_NEAR(z->sigma_yaw_rate_radps, 0.1, 1e-15);
  m.twist.twist.linear.x = kNan;
  EXPECT_FALSE(to_odometry(m, 9, std::nullopt, 0.3).has_value());
}

TEST(ToFacets, AScanIsCompleteInTheOrderOfTimeAndFitsDatagrams) {
  std::mt19937 random(1);
  for (const std::size_t n :
       {std::size_t{1}, kMaxFacetPoints, kMaxFacetPoints + 1, std::size_t{65'536}}) {
    CloudPoints points;
    for (std::size_t i = 0; i < n; ++i) {
      points.x_m.push_back(static_cast<float>(i));
      points.y_m.push_back(0.0F);
      points.z_m.push_back(0.0F);
      points.dt_us.push_back(static_cast<std::int32_t>(random() % 100'000) - 50'000);
    }
    std::vector<ladar_points_t> facets(3);
    to_facets(points, 10'000'000, 5, 2, &facets);
    ASSERT_EQ(facets.size(), (n + kMaxFacetPoints - 1) / kMaxFacetPoints);
    std::vector<float> seen;
    std::int64_t last = 0;
    for (std::size_t f = 0; f < facets.size(); ++f) {
      const ladar_points_t& m = facets[f];
      EXPECT_LE(m.getEncodedSize(), 60'000);
      EXPECT_EQ(m.facet, static_cast<int>(f));
      EXPECT_EQ(m.facet_count, static_cast<int>(facets.size()));
      EXPECT_EQ(m.scan_id, 5);
      EXPECT_EQ(m.sensor_id, 2);
      for (std::size_t i = 0; i < m.dt_us.size(); ++i) {
        const std::int64_t utime = m.utime + m.dt_us[i];
        EXPECT_GE(utime, last);
        last = utime;
        const auto number = static_cast<std::size_t>(m.x_m[i]);
        ASSERT_EQ(utime, 10'000'000 + points.dt_us[number]);
        seen.push_back(m.x_m[i]);
      }
    }
    EXPECT_EQ(last, facets.front().reference_utime) << "the reference is the last point";
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, points.x_m);
  }
}

TEST(ToFacets, WithoutTimesAllPointsAreMeasuredAtTheStamp) {
  CloudPoints points;
  points.x_m = points.y_m = points.z_m = {1.0F, 2.0F};
  std::vector<ladar_points_t> facets;
  to_facets(points, 10'000'000, 5, 0, &facets);
  EXPECT_EQ(facets[0].n_time, 0);
  EXPECT_EQ(facets[0].utime, 10'000'000);
  EXPECT_EQ(facets[0].reference_utime, 10'000'000);
}

}  // namespace
}  // namespace rcs::ros2
