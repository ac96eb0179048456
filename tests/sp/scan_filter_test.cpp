#include "modules/sp/scan_filter.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <tuple>

namespace rcs::sp {
namespace {

TEST(Deskew, UndoesTheMotionDuringTheScan) {
  // GIVEN fixed landmarks seen from a vehicle that drives and turns
  MotionState s;
  s.stamp = from_utime(50'000'000);
  s.v_rolling = Vec3(9.7, 0.0, 0.0);
  s.rate_vehicle_radps = Vec3(0.1, -0.2, 0.5);
  const InertialBuffer none(1);
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Scan scan;
  scan.reference = s.stamp;
  std::vector<Vec3> landmarks;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p_rolling = 30.0 * Vec3(u(rng), u(rng), 0.2 * u(rng));
    const auto dt = Duration(-50'000 + 50 * i);
    const MotionState at = propagate(s, none, s.stamp + dt);
    landmarks.push_back(p_rolling);
    scan.points.push_back((at.T_rolling_vehicle.inverse() * p_rolling).cast<float>());
    scan.dt_us.push_back(static_cast<std::int32_t>(dt.count()));
  }
  // WHEN deskewed
  MotionTable table;
  tabulate_motion(s, none, s.stamp, Duration(-50'000), Duration(49'950), &table);
  deskew(table, &scan);
  // THEN every point is where the vehicle sees it at the reference instant
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    EXPECT_LT((scan.points[i].cast<double>() - landmarks[i]).norm(), 2e-4);
    EXPECT_EQ(scan.dt_us[i], 0);
  }
}

TEST(VoxelSampler, KeepsExactlyOnePointOfEachOccupiedVoxel) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<float> u(-20.0F, 20.0F);
  Points in;
  for (int i = 0; i < 30'000; ++i) in.push_back(Vec3f(u(rng), u(rng), 0.1F * u(rng)));
  VoxelSampler sampler;
  Points out;
  for (const double voxel_m : {0.5, 2.0, 0.5}) {
    sampler.sample(in, voxel_m, &out);
    const auto cell = [&](const Vec3f& p) {
      const Vec3f c = (p / static_cast<float>(voxel_m)).array().floor();
      return std::make_tuple(c.x(), c.y(), c.z());
    };
    std::set<std::tuple<float, float, float>> occupied;
    std::set<std::tuple<float, float, float>> kept;
    for (std::size_t i = 0; i < in.size(); ++i) occupied.insert(cell(in[i]));
    for (std::size_t i = 0; i < out.size(); ++i) kept.insert(cell(out[i]));
    EXPECT_EQ(kept.size(), out.size());
    EXPECT_EQ(kept, occupied);
  }
}

}  // namespace
}  // namespace rcs::sp
