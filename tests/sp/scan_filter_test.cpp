#include "modules/registration/voxel_sampler.h"
#include "modules/sp/scan/column_sampler.h"
#include "modules/sp/scan/deskew.h"
#include "modules/sp/scan/scan.h"
#include "modules/sp/scan/scan_motion.h"

#include <gtest/gtest.h>

#include <map>
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

TEST(KeepEvenly, ThePointsThatRemainAreSpreadOverAllInTheirOrder) {
  Points points;
  for (int k = 0; k < 1000; ++k) points.push_back(Vec3f(static_cast<float>(k), 0.0F, 0.0F));
  Points few = points;
  registration::keep_evenly(1000, &few);
  EXPECT_EQ(few.size(), 1000U);
  registration::keep_evenly(300, &few);
  ASSERT_EQ(few.size(), 300U);
  EXPECT_EQ(few.x[0], 0.0F);
  for (std::size_t k = 1; k < few.size(); ++k) {
    EXPECT_GE(few.x[k] - few.x[k - 1], 3.0F);
    EXPECT_LE(few.x[k] - few.x[k - 1], 4.0F);
  }
  EXPECT_GE(few.x[299], 996.0F);
}

TEST(VoxelSampler, KeepsExactlyOnePointOfEachOccupiedVoxel) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<float> u(-20.0F, 20.0F);
  Points in;
  for (int i = 0; i < 30'000; ++i) in.push_back(Vec3f(u(rng), u(rng), 0.1F * u(rng)));
  registration::VoxelSampler sampler;
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

TEST(ColumnSampler, KeepsTheLowestPointOfEachColumnAlongThePlumbLine) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u(-10.0, 10.0);
  const Quat q_level_vehicle = exp_so3(Vec3(0.2, -0.1, 0.7));
  Points in;
  std::map<std::pair<int, int>, double> lowest;
  for (int k = 0; k < 5000; ++k) {
    const Vec3 level(u(rng), u(rng), u(rng));
    in.push_back((q_level_vehicle.conjugate() * level).cast<float>());
  }
  const Vec3 up = q_level_vehicle.conjugate() * Vec3::UnitZ();
  // Columns may be turned about the plumb line: any frame with that vertical.
  const Quat q = Quat::FromTwoVectors(up, Vec3::UnitZ());
  const auto column = [&](const Vec3& p) {
    return std::pair(static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())));
  };
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vec3 p = q * in[i].cast<double>();
    const auto [it, first] = lowest.emplace(column(p), p.z());
    if (!first) it->second = std::min(it->second, p.z());
  }
  ColumnSampler sampler;
  Points out;
  for (int again = 0; again < 2; ++again) {
    sampler.sample(in, up, 1.0, &out);
    int right = 0;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const Vec3 p = q * out[i].cast<double>();
      right += std::abs(lowest.at(column(p)) - p.z()) < 1e-4 ? 1 : 0;
    }
    // Single precision may put a point on a border into the next column.
    EXPECT_NEAR(static_cast<double>(out.size()), static_cast<double>(lowest.size()), 3.0);
    EXPECT_GE(right, static_cast<int>(out.size()) - 3);
  }
  sampler.sample(Points(), up, 1.0, &out);
  EXPECT_TRUE(out.empty());
}

}  // namespace
}  // namespace rcs::sp
