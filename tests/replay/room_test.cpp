// SP without any other sensor in corridors, with voxels that were configured for a street.
// RCS_SEEDS sets the number of corridors of each width (default 1); the errors are printed.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <set>
#include <vector>

#include "lcmtypes/rcs/registration_t.hpp"
#include "tests/registration/ray_scenes.h"
#include "tests/replay/point_scans.h"
#include "tests/replay/sp_run.h"

namespace rcs::test {
namespace {

constexpr double kHeight_m = 1.0;

unsigned seeds() {
  const char* text = std::getenv("RCS_SEEDS");
  return text != nullptr ? static_cast<unsigned>(std::atoi(text)) : 1U;
}

/// A corridor along x, with things along its walls whose sizes are shares of its width.
RayScene corridor(double width_m, std::mt19937* rng) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double half = 0.5 * width_m;
  RayScene s;
  s.boxes = {{{-100.0, half, 0.0}, {100.0, half + 1.0, 3.0}},
             {{-100.0, -half - 1.0, 0.0}, {100.0, -half, 3.0}},
             {{-100.0, -half - 1.0, 3.0}, {100.0, half + 1.0, 3.2}}};
  const auto share = [&](double least, double range) {
    return (least + range * u(*rng)) * width_m;
  };
  for (double x = -30.0; x < 40.0; x += share(0.25, 0.5)) {
    const double deep = share(0.05, 0.1);
    s.boxes.push_back({{x, half - deep, 0.0}, {x + share(0.1, 0.2), half, 0.5 + 2.0 * u(*rng)}});
    s.boxes.push_back({{x + 0.2 * width_m, -half, 0.0},
                       {x + share(0.3, 0.2), -half + deep, 0.5 + 2.0 * u(*rng)}});
  }
  return s;
}

/// Swaying and turning ahead, by 4 % of the width a scan.
std::vector<Pose> way(double width_m) {
  std::vector<Pose> poses;
  constexpr int kScans = 60;
  poses.reserve(kScans);
  for (int k = 0; k < kScans; ++k) {
    const double x_m = 0.04 * width_m * (k - 30);
    poses.push_back({exp_so3(Vec3(0.0, 0.0, 0.3 * std::sin(0.15 * k))),
                     Vec3(x_m, 0.1 * width_m * std::sin(0.1 * k), kHeight_m)});
  }
  return poses;
}

std::vector<registration_t> registered(const RayScene& scene, const std::vector<Pose>& poses,
                                       double voxel_m, std::mt19937* rng) {
  std::vector<Points> scans;
  scans.reserve(poses.size());
  for (const Pose& pose : poses) scans.push_back(scan(scene, scan_patterns()[1], pose, rng));
  PointScans source(std::move(scans), from_milliseconds(100.0), 1);
  return registrations_of(&source, "[sp.map]\nvoxel_m = " + std::to_string(voxel_m) + "\n");
}

TEST(Room, VoxelsOfAStreetAreNoneOfACorridor) {
  for (const double width_m : {4.0, 8.0, 16.0}) {
    for (unsigned seed = 1; seed <= seeds(); ++seed) {
      for (const double voxel_m : {0.5, 1.5}) {
        std::mt19937 rng(seed);
        const RayScene scene = corridor(width_m, &rng);
        const std::vector<Pose> poses = way(width_m);
        const std::vector<registration_t> found = registered(scene, poses, voxel_m, &rng);
        ASSERT_EQ(found.size(), poses.size());
        double worst_m = 0.0;
        int unusable = 0;
        for (std::size_t k = 1; k < found.size(); ++k) {
          const Pose truth = poses[0].inverse() * poses[k];
          unusable += is_usable(found[k]) ? 0 : 1;
          if (!is_usable(found[k])) continue;
          worst_m = std::max(worst_m, (truth.inverse() * pose_of(found[k])).p.norm());
        }
        std::printf("width %.0f m, seed %u, voxel_m %.1f: error %.3f m\n", width_m, seed, voxel_m,
                    worst_m);
        EXPECT_LT(worst_m, 0.1) << width_m << " m, " << voxel_m;
        EXPECT_LE(unusable, 2) << width_m << " m, " << voxel_m;  // ambiguous at first
      }
    }
  }
}

/// From a corridor into a hall: the map begins again with larger voxels.
TEST(Room, AHallBehindACorridorBeginsAnotherMap) {
  std::mt19937 rng(7);
  constexpr double kRoof_m = 2.0;
  RayScene scene = corridor(3.0, &rng);
  // The corridor ends at x = 0; the hall is 40 m wide.
  for (RayScene::Box& box : scene.boxes) box.high.x() = std::min(box.high.x(), 0.0);
  scene.boxes.erase(std::remove_if(scene.boxes.begin(), scene.boxes.end(),
                                   [](const auto& box) { return box.low.x() >= box.high.x(); }),
                    scene.boxes.end());
  scene.boxes.push_back({{0.0, 20.0, 0.0}, {60.0, 21.0, 8.0}});
  scene.boxes.push_back({{0.0, -21.0, 0.0}, {60.0, -20.0, 8.0}});
  scene.boxes.push_back({{60.0, -20.0, 0.0}, {61.0, 20.0, 8.0}});
  for (const double x : {6.0, 13.0, 21.5, 33.0}) {
    scene.boxes.push_back({{x, 3.0 + 0.3 * x, 0.0}, {x + 2.0, 5.0 + 0.3 * x, 4.0}});
    scene.boxes.push_back({{x + 3.0, -9.0, 0.0}, {x + 4.5, -7.0, 3.0}});
  }
  std::vector<Pose> poses;
  constexpr int kScans = 120;
  poses.reserve(kScans);
  for (int k = 0; k < kScans; ++k) {
    poses.push_back({Quat::Identity(), Vec3(-8.0 + 0.2 * k, 0.0, kRoof_m)});
  }
  const std::vector<registration_t> found = registered(scene, poses, 0.5, &rng);
  std::set<int> epochs;
  int unusable = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    epochs.insert(found[k].map_epoch);
    unusable += is_usable(found[k]) ? 0 : 1;
    if (k == 0 || found[k].map_epoch != found[k - 1].map_epoch || !is_usable(found[k])) continue;
    const auto scans = static_cast<double>(found[k].scan_id - found[k - 1].scan_id);
    const Vec3 moved = (pose_of(found[k - 1]).inverse() * pose_of(found[k])).p;
    EXPECT_LT((moved - Vec3(0.2 * scans, 0.0, 0.0)).norm(), 0.1) << k;
  }
  EXPECT_GE(epochs.size(), 2U);
  EXPECT_LE(unusable, 3);
}

}  // namespace
}  // namespace rcs::test
