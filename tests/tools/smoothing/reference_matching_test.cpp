// Selection of the scans to match to each map, and recovery of a known shift by a match.

#include "tools/smoothing/reference_matching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rcs::smoothing {
namespace {

/// A drive of 400 m, out and back on a parallel path; the field of view covers the surroundings of
/// the vehicle.
struct Drive {
  std::vector<NodeCloud> clouds;
  std::vector<double> travelled_m;
  std::vector<Pose> seen;
};

Points bumpy_ground(const Pose& T_world_vehicle, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-15.0, 15.0);
  const Pose back = T_world_vehicle.inverse();
  Points points;
  for (int k = 0; k < 4000; ++k) {
    const double x = T_world_vehicle.p.x() + place(random);
    const double y = T_world_vehicle.p.y() + place(random);
    const double z = 1.5 * std::sin(0.3 * x) + 1.2 * std::sin(0.4 * y + 0.1 * x);
    points.push_back((back * Vec3(x, y, z)).cast<float>());
  }
  return points;
}

Drive out_and_back() {
  Drive d;
  for (int k = 0; k < 40; ++k) {
    const bool back = k >= 20;
    const double x = 5.0 * (back ? 39 - k : k);
    const Pose T{exp_so3(Vec3(0, 0, back ? kPi : 0.0)), Vec3(x, back ? 1.0 : 0.0, 0.5)};
    NodeCloud cloud;
    cloud.dense = bumpy_ground(T, static_cast<std::uint32_t>(k + 1));
    cloud.source = cloud.dense;
    d.clouds.push_back(cloud);
    d.travelled_m.push_back(5.0 * k);
    d.seen.push_back(T);
  }
  return d;
}

TEST(ReferenceMatching, PlansMatchesToEarlierAndOtherPasses) {
  const Drive d = out_and_back();
  const MatchingParams p;
  std::size_t consecutive = 0;
  std::size_t revisits = 0;
  for (const PlannedMatch& m : plan_matches(d.clouds, d.travelled_m, d.seen, p)) {
    const double apart_m = d.travelled_m[m.scan] - d.travelled_m[m.map];
    if (m.revisit) {
      ++revisits;
      EXPECT_GE(std::abs(apart_m), p.other_pass_m);
      EXPECT_LE((d.seen[m.scan].p - d.seen[m.map].p).norm(), p.view_m);
    } else {
      ++consecutive;
      EXPECT_GE(apart_m, p.before_m);
    }
    EXPECT_NE(m.map, m.scan);
  }
  EXPECT_GT(consecutive, 30U);
  EXPECT_GT(revisits, 20U);
}

TEST(ReferenceMatching, AMatchReturnsThePoseError) {
  Drive d = out_and_back();
  const std::vector<Pose> truth = d.seen;
  for (std::size_t k = 20; k < d.seen.size(); ++k) {
    d.seen[k] = Pose{exp_so3(Vec3(0, 0, 0.01)), Vec3(0.15, -0.1, 0.05)} * d.seen[k];
  }
  sp::SpConfig config;
  config.map.voxel_m = 0.7;
  MatchingParams params;
  const auto quiet = [](std::size_t, std::size_t) {};
  const Matches found = match_nodes(d.clouds, d.travelled_m, d.seen, config, params, 0.3, quiet,
                                    [] { return false; });
  EXPECT_EQ(found.revisit.made, found.revisit.tried);
  ASSERT_GT(found.revisit.made, 20U);
  for (const MatchEdge& e : found.edges) {
    const Vec6 error = log_se3(e.T_map_scan.inverse() * truth[e.map].inverse() * truth[e.scan]);
    EXPECT_LT(error.head<3>().norm(), 0.1) << e.map << " " << e.scan;
    EXPECT_GT(e.information(0, 0), 0.0);
    EXPECT_LT(e.information(0, 0), 1.01 / params.sigma_floor_m / params.sigma_floor_m);
  }
  params.jobs = 2;
  const Matches again = match_nodes(d.clouds, d.travelled_m, d.seen, config, params, 0.3, quiet,
                                    [] { return false; });
  ASSERT_EQ(again.edges.size(), found.edges.size());
  for (std::size_t k = 0; k < found.edges.size(); ++k) {
    EXPECT_EQ(again.edges[k].T_map_scan.p, found.edges[k].T_map_scan.p);
  }
  const MapResidual wrong = map_residual(d.clouds, d.travelled_m, d.seen, config, params, 0.3);
  const MapResidual right = map_residual(d.clouds, d.travelled_m, truth, config, params, 0.3);
  EXPECT_LT(right.rms_m, wrong.rms_m);
}

}  // namespace
}  // namespace rcs::smoothing
