// SP without INS: scans that are far apart in time, turned and moved between them, and another
// place all of a sudden.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/registration_t.hpp"
#include "tests/registration/ray_scenes.h"
#include "tests/replay/point_scans.h"
#include "tests/replay/sp_run.h"

namespace rcs::test {
namespace {

constexpr double kHeight_m = 1.8;
const Pose kMount{Quat::Identity(), Vec3(0.8, -0.3, 1.0)};  // of the LADAR in the vehicle

std::vector<registration_t> registered(Duration interval, std::vector<Points> scans) {
  PointScans source(std::move(scans), interval, 1);
  return registrations_of(&source, "mount_m = [0.8, -0.3, 1.0]\n");
}

const ScanPattern& rings() { return scan_patterns()[1]; }

Pose at(double x_m, double y_m, double yaw_rad) {
  return {exp_so3(Vec3(0.0, 0.0, yaw_rad)), Vec3(x_m, y_m, kHeight_m)};
}

void expect_followed(const std::vector<Pose>& poses, Duration interval) {
  std::mt19937 rng(17);
  const RayScene scene = street(true);
  std::vector<Points> scans;
  scans.reserve(poses.size());
  for (const Pose& pose : poses) scans.push_back(scan(scene, rings(), pose, &rng));
  const std::vector<registration_t> found = registered(interval, std::move(scans));
  ASSERT_EQ(found.size(), poses.size());
  for (std::size_t k = 1; k < found.size(); ++k) {
    const Pose truth = kMount * poses[0].inverse() * poses[k] * kMount.inverse();
    const Pose off = truth.inverse() * pose_of(found[k]);
    EXPECT_TRUE(is_usable(found[k])) << k;
    EXPECT_LT(off.p.norm(), 0.1) << k;
    EXPECT_LT(log_so3(off.q).norm(), radians(1.0)) << k;
    EXPECT_EQ(found[k].map_epoch, found[0].map_epoch) << k;
  }
}

TEST(LadarAlone, AHandThatTurnsBy45DegBetweenScansIsFollowed) {
  std::vector<Pose> poses;
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  double x = -10.0;
  double yaw = 0.0;
  for (int k = 0; k < 20; ++k) {
    poses.push_back(at(x, 1.5 * u(rng), yaw));
    x += 0.6 + 0.4 * u(rng);
    yaw += radians(45.0) * (k % 3 == 0 ? -1.0 : 1.0) * std::abs(u(rng));
  }
  expect_followed(poses, from_milliseconds(500.0));
}

TEST(LadarAlone, AVehicleThatMovesByThreeMetresBetweenScansIsFollowed) {
  std::vector<Pose> poses;
  poses.reserve(12);
  for (int k = 0; k < 12; ++k) poses.push_back(at(-18.0 + 2.7 * k, 0.1 * k, 0.02 * k));
  expect_followed(poses, from_milliseconds(417.0));
}

TEST(LadarAlone, AnotherPlaceIsNoticedAndBeginsAnotherMap) {
  std::mt19937 rng(23);
  const RayScene one = street(true);
  RayScene other;
  other.boxes = {{{-60.0, 12.0, 0.0}, {60.0, 13.0, 6.0}}, {{-8.0, -25.0, 0.0}, {-6.5, 11.0, 6.0}}};
  for (const double x : {2.0, 9.5, 15.0, 28.0}) {
    other.boxes.push_back({{x, -6.0 + 0.4 * x, 0.0}, {x + 2.2, -3.5 + 0.4 * x, 3.0}});
  }
  constexpr int kBefore = 10;
  constexpr int kAfter = 40;
  std::vector<Points> scans;
  scans.reserve(kBefore + kAfter);
  for (int k = 0; k < kBefore; ++k) scans.push_back(scan(one, rings(), at(0.4 * k, 0, 0), &rng));
  for (int k = 0; k < kAfter; ++k) scans.push_back(scan(other, rings(), at(0.4 * k, 0, 0), &rng));
  const std::vector<registration_t> found = registered(from_milliseconds(100.0), std::move(scans));
  // The scan that begins another map has two results.
  ASSERT_GE(found.size(), static_cast<std::size_t>(kBefore + kAfter));
  int unnoticed = 0;
  std::size_t k = kBefore;
  for (; k < found.size() && found[k].map_epoch == found[0].map_epoch; ++k) {
    unnoticed += is_usable(found[k]) ? 1 : 0;
  }
  EXPECT_LE(unnoticed, 2);
  ASSERT_LT(k + 3, found.size()) << "a new map begins";
  const Pose first = pose_of(found[k]);
  const Pose last = pose_of(found.back());
  EXPECT_TRUE(is_usable(found.back()));
  const auto moved = static_cast<double>(found.back().scan_id - found[k].scan_id);
  EXPECT_NEAR((first.inverse() * last).p.norm(), 0.4 * moved, 0.1);
}

}  // namespace
}  // namespace rcs::test
