#include "sim/sensors/ladar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

constexpr std::uint64_t kSeed = 5;

TEST(RangeImager, RangesOnLevelGroundMatchTheClosedForm) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 100.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);  // at rest, looking east
  RangeImager imager({}, ideal_beam(), exact_mount(), kSeed);
  const double tilt = radians(-10.0);
  RangeFacet facet;
  int compared = 0;
  for (int k = 0; k < 16; ++k) {
    imager.render(world, vehicle, 0.5, k, &facet);
    ASSERT_EQ(facet.range_m.size(), 360U);
    EXPECT_EQ(facet.first_row, 2 * k);
    EXPECT_DOUBLE_EQ(facet.head.tilt_rad, tilt);
    for (int row = 0; row < 2; ++row) {
      for (int col = 0; col < 180; ++col) {
        const double elevation = radians(-10.0 + (2 * k + row + 0.5) * 0.625);
        const double azimuth = radians(45.0 - (col + 0.5) * 0.5);
        // Height of the shot's direction after the head's tilt, by hand.
        const double down = -(std::cos(tilt) * std::sin(elevation) +
                              std::sin(tilt) * std::cos(elevation) * std::cos(azimuth));
        const double expected = down > 0.0 ? 1.8 / down : 1e9;
        const float measured = facet.range_m[static_cast<std::size_t>(row * 180 + col)];
        if (expected > 60.0) {
          EXPECT_EQ(measured, 0.0F);
        } else {
          EXPECT_NEAR(measured, expected, 1e-5) << k << " " << row << " " << col;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 4000);
}

// The essential property of the simulation: for any motion of vehicle and head during a scan, a
// point transformed with the true pose of its own shot lies on the ground.
TEST(RangeImager, PointsAtTheirOwnTimeLieOnTheGround) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 100.0);
  const Trajectory vehicle = drive(course, world, {}, 14.0);
  ImagerParams params;
  params.tilt_rad = 0.0;
  params.sweep_rad = radians(30.0);
  params.sweep_hz = 0.25;
  MountParams mount;  // with errors: the true mount is used
  RangeImager imager(params, ideal_beam(), mount, kSeed);
  RangeFacet facet;
  double worst_m = 0.0;
  int points = 0;
  for (int scan = 0; scan < 130; ++scan) {
    for (int k = 0; k < 16; k += 5) {
      const double start_s = 0.1 * scan + 0.00625 * k;
      imager.render(world, vehicle, start_s, k, &facet);
      for (std::size_t n = 0; n < facet.range_m.size(); ++n) {
        const double range_m = facet.range_m[n];
        if (range_m == 0.0) continue;
        const int col = static_cast<int>(n % 180);
        const double time_s = start_s + 0.00625 * col / 180.0;
        const Vec3 p_ladar =
            range_m * imager.direction(facet.first_row + static_cast<int>(n / 180), col);
        const Vec3 p_world = vehicle.pose_at(time_s) * (imager.T_vehicle_ladar(time_s) * p_ladar);
        worst_m = std::max(worst_m, std::abs(p_world.z() - world.height(p_world.x(), p_world.y())));
        ++points;
      }
    }
  }
  EXPECT_GT(points, 30000);
  EXPECT_LT(worst_m, 1e-3);  // straight lines between poses 0.7 ms apart, at 60 m
}

TEST(RangeImager, EncoderFollowsTheHeadWithinAFacet) {
  ImagerParams params;
  params.sweep_rad = radians(30.0);
  const RangeImager imager(params, ideal_beam(), exact_mount(), kSeed);
  for (double t = 0.0; t < 4.0; t += 0.1) {
    const HeadAngle a = imager.head_at(t);
    const HeadAngle b = imager.head_at(t + imager.facet_duration_s());
    // Half the head's largest acceleration times the facet's duration squared.
    EXPECT_NEAR(a.tilt_rad + a.tilt_rate_radps * imager.facet_duration_s(), b.tilt_rad, 3e-5);
  }
}

TEST(RangeImager, MissingReturnsAndEmptyFacetsHaveTheirRates) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 100.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);
  ImagerParams params;
  params.tilt_rad = radians(-30.0);  // everything in range
  BeamParams beam = ideal_beam();
  beam.missing_share = 0.15;
  beam.empty_facet_share = 0.03;
  RangeImager imager(params, beam, exact_mount(), kSeed);
  RangeFacet facet;
  int missing = 0;
  int empty = 0;
  const int facets = 4000;
  for (int k = 0; k < facets; ++k) {
    imager.render(world, vehicle, 0.5, k % 16, &facet);
    if (facet.range_m.empty()) {
      ++empty;
      missing += 360;
    }
    for (const float r : facet.range_m) missing += r == 0.0F ? 1 : 0;
  }
  // Four sigma of a binomial of 4000 facets: 0.011.
  EXPECT_NEAR(static_cast<double>(empty) / facets, 0.03, 0.011);
  EXPECT_NEAR(static_cast<double>(missing) / (360.0 * facets), 0.15, 0.011);
}

TEST(RangeImager, NoiseIsThatOfRangeAndFootprint) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 100.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);
  ImagerParams params;
  params.tilt_rad = radians(-30.0);
  BeamParams noisy = ideal_beam();
  noisy.sigma_m = 0.03;
  noisy.half_angle_rad = radians(0.1);
  RangeImager ideal(params, ideal_beam(), exact_mount(), kSeed);
  RangeImager imager(params, noisy, exact_mount(), kSeed);
  RangeFacet truth, facet;
  double squares = 0.0;
  int n = 0;
  for (int k = 0; k < 800; ++k) {
    ideal.render(world, vehicle, 0.5, k % 16, &truth);
    imager.render(world, vehicle, 0.5, k % 16, &facet);
    for (std::size_t i = 0; i < facet.range_m.size(); ++i, ++n) {
      const double range_m = truth.range_m[i];
      const double c = 1.8 / range_m;  // cosine of incidence on level ground
      const double slant = 0.25 * range_m * radians(0.1) * std::sqrt(1.0 - c * c) / c;
      const double e = (facet.range_m[i] - range_m) / std::hypot(0.03, slant);
      squares += e * e;
    }
  }
  EXPECT_NEAR(squares / n, 1.0, 0.02);
}

TEST(RangeImager, MountErrorHasTheStatedSize) {
  const MountParams mount;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const RangeImager off({}, ideal_beam(), mount, seed);
    const RangeImager exact({}, ideal_beam(), exact_mount(), seed);
    const Pose d = exact.T_vehicle_ladar(0.0).inverse() * off.T_vehicle_ladar(0.0);
    EXPECT_NEAR(d.p.norm(), 0.01, 1e-9);
    EXPECT_NEAR(log_so3(d.q).norm(), radians(0.2), 1e-9);
  }
}

TEST(SpinningLadar, PointsAtTheirOwnTimeLieOnTheGround) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 140.0);
  const Trajectory vehicle = drive(course, world, {}, 10.0);
  BeamParams beam = ideal_beam();
  beam.max_range_m = 120.0;
  SpinningLadar ladar({}, beam, exact_mount(), kSeed);
  PointSector sector;
  double worst_m = 0.0;
  for (const int k : {0, 11, 24, 47}) {
    const double start_s = 8.0 + k * 0.1 / 48;
    ladar.render(world, vehicle, start_s, k, &sector);
    ASSERT_GT(sector.x_m.size(), 500U);
    for (std::size_t n = 0; n < sector.x_m.size(); ++n) {
      const Pose T_world_ladar =
          vehicle.pose_at(start_s + sector.dt_us[n] * 1e-6) * ladar.T_vehicle_ladar();
      const Vec3 p_world = T_world_ladar * Vec3(sector.x_m[n], sector.y_m[n], sector.z_m[n]);
      worst_m = std::max(worst_m, std::abs(p_world.z() - world.height(p_world.x(), p_world.y())));
      EXPECT_EQ(sector.col[n] / 38, k);
    }
  }
  EXPECT_LT(worst_m, 1e-3);  // times are whole microseconds
}

}  // namespace
}  // namespace rcs::sim
