// People and vehicles that move: obstacles at once, and the ground is free again when they have
// left. What does not move stays.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "modules/wm/terrain/terrain_grid.h"
#include "tests/support/heap_guard.h"
#include "tests/wm/imager.h"

namespace rcs::wm {
namespace {

constexpr double kRange_m = 60.0;

using Solid = std::function<bool(const Vec3& p, double time_s)>;

class UprightTest : public testing::Test {
 protected:
  explicit UprightTest(double upright_m = 1.1) : grid_(params(upright_m)) {}

  /// Ten scans a second from `from_s` on.
  /// @param foliage  share of the rays that pass a solid
  void scan(const Solid& solid, double from_s, double to_s, double speed_mps = 0.0,
            double foliage = 0.0) {
    for (double t = from_s; t < to_s - 1e-6; t += 0.1) {
      T_ = Pose{Quat::Identity(), Vec3(speed_mps * t, 0.0, 0.9)};
      const Points points = imager_scan(
          T_,
          [&](const Vec3& at, const Vec3& ray) -> std::optional<double> {
            const bool passes = unit_(rng_) < foliage;
            const double ground_m = ray.z() < 0.0 ? -at.z() / ray.z() : kRange_m;
            for (double r = 4.0; r < std::min(ground_m, 24.0) && !passes; r += 0.04) {
              if (solid(at + r * ray, t)) return std::optional<double>(r);
            }
            return ground_m < kRange_m ? std::optional<double>(ground_m) : std::nullopt;
          },
          &rng_);
      const test::HeapGuard guard;
      grid_.insert(points, T_);
      EXPECT_EQ(guard.allocations(), 0);
    }
  }
  [[nodiscard]] int obstacles(double x0, double x1, double y0, double y1) {
    const Cell first = grid_.patch(T_, &answers_);
    const double cell_m = grid_.params().cell_m;
    int count = 0;
    for (double y = y0; y < y1; y += cell_m) {
      for (double x = x0; x < x1; x += cell_m) {
        const int i = static_cast<int>(std::floor(x / cell_m)) - first.i;
        const int j = static_cast<int>(std::floor(y / cell_m)) - first.j;
        count += answers_[static_cast<std::size_t>(j * grid_.params().patch + i)].obstacle ? 1 : 0;
      }
    }
    return count;
  }

 private:
  static TerrainParams params(double upright_m) {
    TerrainParams p;
    p.edge_range_m = 10.0;
    p.upright_m = upright_m;
    p.p_vehicle_ladar = kImager;
    return p;
  }

  TerrainGrid grid_;
  std::mt19937 rng_{5};
  std::uniform_real_distribution<> unit_{0.0, 1.0};
  std::vector<TerrainAnswer> answers_;
  Pose T_;
};

/// A person at (x, y) [m].
bool in_person(const Vec3& p, double x, double y) {
  return p.z() < 1.8 && std::hypot(p.x() - x, p.y() - y) < 0.3;
}

TEST_F(UprightTest, APersonIsAnObstacleAtOnceAndLeavesNone) {
  for (const double distance_m : {8.0, 12.0, 18.0}) {
    for (const double speed_mps : {0.5, 1.0, 2.0}) {
      const auto y_at = [&](double t) { return -4.0 + speed_mps * t; };
      const Solid crossing = [&](const Vec3& p, double t) {
        return in_person(p, distance_m, y_at(t));
      };
      const double end_s = 8.0 / speed_mps;
      scan([](const Vec3&, double) { return false; }, -1.0, 0.0);
      int missed = 0;
      int far = 0;
      for (double t = 0.0; t < end_s - 1e-6; t += 0.1) {
        scan(crossing, t, t + 0.1);
        const double y = y_at(t);
        missed += obstacles(distance_m - 0.6, distance_m + 0.6, y - 0.6, y + 0.6) == 0 ? 1 : 0;
        far += obstacles(distance_m - 0.6, distance_m + 0.6, -5.0, y - 0.6 - 1.0 * speed_mps);
      }
      std::printf("%.0f m, %.1f m/s: %d scans without the obstacle, %d cells left behind\n",
                  distance_m, speed_mps, missed, far);
      EXPECT_EQ(missed, 0);
      EXPECT_EQ(far, 0) << "a second after it was there";
      scan([](const Vec3&, double) { return false; }, end_s, end_s + 2.0);
      EXPECT_EQ(obstacles(4.0, 22.0, -6.0, 6.0), 0);
    }
  }
}

TEST_F(UprightTest, WhatDoesNotMoveStays) {
  struct Case {
    const char* what;
    Solid solid;
    double foliage;
  };
  const std::vector<Case> cases = {
      {"trunk", [](const Vec3& p, double) { return std::hypot(p.x() - 16, p.y() - 0.1) < 0.15; },
       0},
      {"wall", [](const Vec3& p, double) { return std::abs(p.x() - 16) < 0.2 && p.z() < 1.4; }, 0},
      {"wall along",
       [](const Vec3& p, double) {
         return std::abs(p.y() - 1.27) < 0.2 && p.x() > 15 && p.z() < 1.4;
       },
       0},
      {"bush", [](const Vec3& p, double) { return (p - Vec3(16, 0, 0.6)).norm() < 0.9; }, 0.6},
  };
  for (const Case& c : cases) {
    scan([](const Vec3&, double) { return false; }, -1.0, 0.0);
    scan(c.solid, 0.0, 0.5, 2.0, c.foliage);
    int fewest = 1000;
    for (double t = 0.5; t < 5.0; t += 0.1) {
      scan(c.solid, t, t + 0.1, 2.0, c.foliage);
      fewest = std::min(fewest, obstacles(15.0, 17.0, -1.0, 1.6));
    }
    std::printf("%s: at least %d obstacle cells\n", c.what, fewest);
    EXPECT_GT(fewest, 0) << c.what;
    scan([](const Vec3&, double) { return false; }, 5.0, 6.5);
  }
}

/// Without the rule.
class NoUprightTest : public UprightTest {
 protected:
  NoUprightTest() : UprightTest(0.0) {}
};

TEST_F(NoUprightTest, APersonIsSeenLateOrNotAtAll) {
  const Solid crossing = [&](const Vec3& p, double t) {
    return in_person(p, 12.0, -4.0 + 2.0 * t);
  };
  scan([](const Vec3&, double) { return false; }, -1.0, 0.0);
  int missed = 0;
  for (double t = 0.0; t < 4.0; t += 0.1) {
    scan(crossing, t, t + 0.1);
    const double y = -4.0 + 2.0 * t;
    missed += obstacles(11.4, 12.6, y - 0.6, y + 0.6) == 0 ? 1 : 0;
  }
  EXPECT_GT(missed, 10);
}

}  // namespace
}  // namespace rcs::wm
