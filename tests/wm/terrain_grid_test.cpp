#include "modules/wm/terrain/terrain_grid.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/heap_guard.h"

namespace rcs::wm {
namespace {

/// Scans of a plane that rises along x, with a box on it, from a passing vehicle.
class TerrainGridTest : public testing::Test {
 protected:
  static constexpr double kRise = 0.2;  // per metre
  static constexpr double kBoxHeight_m = 0.6;

  static double ground(double x) { return kRise * x; }
  static bool in_box(double x, double y) { return std::abs(x - 10.0) < 0.5 && std::abs(y) < 0.5; }

  void scan(const Pose& T_local_vehicle, bool box, int n = 3000) {
    points_.clear();
    for (int k = 0; k < n; ++k) {
      const double x = T_local_vehicle.p.x() + 25.0 * unit_(rng_);
      const double y = 15.0 * (unit_(rng_) - 0.5);
      double z = ground(x);
      if (box && in_box(x, y)) z += kBoxHeight_m * unit_(rng_);
      const Vec3 p(x, y, z + 0.02 * normal_(rng_));
      points_.push_back((T_local_vehicle.inverse() * p).cast<float>());
    }
    grid_.insert(points_, T_local_vehicle);
  }
  [[nodiscard]] TerrainAnswer at(const Pose& T, double x, double y) {
    const Cell first = grid_.patch(T, &answers_);
    const double cell_m = grid_.params().cell_m;
    const int i = static_cast<int>(std::floor(x / cell_m)) - first.i;
    const int j = static_cast<int>(std::floor(y / cell_m)) - first.j;
    return answers_[static_cast<std::size_t>(j * grid_.params().patch + i)];
  }

  std::mt19937 rng_{4};
  std::uniform_real_distribution<> unit_{0.0, 1.0};
  std::normal_distribution<> normal_{0.0, 1.0};
  TerrainGrid grid_{TerrainParams{}};
  Points points_;
  std::vector<TerrainAnswer> answers_;
  // The vehicle is tilted, as the ground is.
  Pose T_{exp_so3(Vec3(0.03, -std::atan(kRise), 0.0)), Vec3(0.0, 0.0, 0.9)};
};

TEST_F(TerrainGridTest, MapsThePlaneAndTheObstacleOnIt) {
  for (int k = 0; k < 10; ++k) scan(T_, true);
  const TerrainAnswer plain = at(T_, 6.0, 3.0);
  EXPECT_TRUE(plain.known);
  EXPECT_FALSE(plain.obstacle);
  EXPECT_NEAR(plain.height_m, ground(6.0), 0.08);
  EXPECT_NEAR(plain.slope_rad, std::atan(kRise), 0.03);
  EXPECT_LT(plain.roughness_m, 0.05);
  EXPECT_LT(plain.step_m, 0.15);
  const TerrainAnswer box = at(T_, 10.0, 0.0);
  EXPECT_TRUE(box.obstacle);
  EXPECT_GT(box.step_m, 0.25);
  EXPECT_FALSE(at(T_, -8.0, 0.0).known);
  int false_alarms = 0;
  const Cell first = grid_.patch(T_, &answers_);
  const int side = grid_.params().patch;
  for (std::size_t k = 0; k < answers_.size(); ++k) {
    const int i = first.i + static_cast<int>(k) % side;
    const int j = first.j + static_cast<int>(k) / side;
    const double x = (i + 0.5) * 0.4;
    const double y = (j + 0.5) * 0.4;
    const bool near_box = std::abs(x - 10.0) < 1.3 && std::abs(y) < 1.3;
    false_alarms += answers_[k].obstacle && !near_box ? 1 : 0;
  }
  EXPECT_EQ(false_alarms, 0);
}

// In front of a wall, scans do not determine the height of the vehicle: it has sunk by 0.45 m when
// they show the ground again.
TEST_F(TerrainGridTest, AVehicleThatHasSunkInFrameLocalSeesNoLedge) {
  for (int k = 0; k < 10; ++k) scan(T_, false, 8000);
  for (int k = 0; k < 10; ++k) {
    points_.clear();
    for (int n = 0; n < 8000; ++n) {
      const double x = 5.0 + 15.0 * unit_(rng_);
      const double y = 10.0 * unit_(rng_);  // a part of the ground only
      const Vec3 p(x, y, ground(x) + 0.02 * normal_(rng_));
      points_.push_back((T_.inverse() * p).cast<float>());
    }
    grid_.insert(points_, {T_.q, T_.p - Vec3(0.0, 0.0, 0.45)});
  }
  const Pose T{T_.q, T_.p - Vec3(0.0, 0.0, 0.45)};
  EXPECT_NEAR(at(T, 8.0, 3.0).height_m, ground(8.0) - 0.45, 0.1);
  EXPECT_NEAR(at(T, 8.0, -3.0).height_m, ground(8.0) - 0.45, 0.1) << "not seen since";
  for (double y = -4.0; y < 4.0; y += 0.4) EXPECT_FALSE(at(T, 7.0, y).obstacle) << y;
}

// Ground that was seen bare from near is later seen from afar, when the rays end in its grass.
TEST_F(TerrainGridTest, GrassDoesNotMoveTheTerrain) {
  const auto insert = [&](double to_ground) {
    points_.clear();
    for (int n = 0; n < 20'000; ++n) {
      const double x = 5.5 + 6.0 * unit_(rng_);
      const double y = 6.0 * (unit_(rng_) - 0.5);
      const double grass_m = unit_(rng_) < to_ground ? 0.0 : 0.1 + 0.15 * unit_(rng_);
      const Vec3 p(x, y, ground(x) + grass_m + 0.02 * normal_(rng_));
      points_.push_back((T_.inverse() * p).cast<float>());
    }
    grid_.insert(points_, T_);
  };
  for (int k = 0; k < 10; ++k) insert(0.3);
  const float before_m = at(T_, 8.0, 1.0).height_m;
  EXPECT_NEAR(before_m, ground(8.0), 0.06);
  for (int k = 0; k < 10; ++k) insert(0.0);
  // The heights follow slowly, each cell for itself.
  EXPECT_LT(at(T_, 8.0, 1.0).height_m, before_m + 0.08F);
}

TEST_F(TerrainGridTest, ASingleObservationIsNoObstacle) {
  constexpr int kDense = 60'000;  // every quarter of the box is observed up to its top
  for (int k = 0; k < 5; ++k) scan(T_, false);
  scan(T_, true, kDense);
  EXPECT_FALSE(at(T_, 10.0, 0.0).obstacle);
  for (int k = 0; k < 4; ++k) scan(T_, true, kDense);
  EXPECT_TRUE(at(T_, 10.0, 0.0).obstacle);
}

// A low rock without points above the grass: its surface is observed in every scan, while grass
// lets some rays through to the ground.
TEST_F(TerrainGridTest, DistinguishesARockFromGrass) {
  for (int k = 0; k < 12; ++k) {
    points_.clear();
    for (int n = 0; n < 20'000; ++n) {
      const double x = 20.0 * unit_(rng_);
      const double y = 10.0 * (unit_(rng_) - 0.5);
      const bool rock = std::hypot(x - 8.0, y) < 0.5;
      const bool grass = x > 12.0;
      const double z = ground(x) + (rock ? 0.35 : grass ? 0.25 * unit_(rng_) : 0.0);
      points_.push_back((T_.inverse() * Vec3(x, y, z + 0.02 * normal_(rng_))).cast<float>());
    }
    grid_.insert(points_, T_);
  }
  EXPECT_TRUE(at(T_, 8.0, 0.0).obstacle);
  int in_grass = 0;
  for (double x = 13.0; x < 19.0; x += 0.4) {
    for (double y = -4.0; y < 4.0; y += 0.4) in_grass += at(T_, x, y).obstacle ? 1 : 0;
  }
  EXPECT_EQ(in_grass, 0);
}

// At long range the position of a point is wrong by decimetres along the ray: the lowest points of
// many scans are those of the ground around a rock.
TEST_F(TerrainGridTest, ARockIsDetectedAtShortRangeAfterInaccurateScansAtLongRange) {
  const auto look = [this](TerrainGrid* grid, double from_m, double error_m) {
    const Pose T{Quat::Identity(), Vec3(8.0 - from_m, 0.0, 1.8)};
    points_.clear();
    const double off_m = error_m * normal_(rng_);
    for (int n = 0; n < 8000; ++n) {
      const double x = 4.0 + 8.0 * unit_(rng_);
      const double y = 8.0 * (unit_(rng_) - 0.5);
      const double away = std::hypot(x - 8.0, y) / 0.4;
      const double z = away < 1.0 ? 0.33 * std::sqrt(1.0 - away * away) : 0.0;
      const Vec3 p(x + off_m, y, z + 0.02 * normal_(rng_));
      points_.push_back((T.inverse() * p).cast<float>());
    }
    grid->insert(points_, T);
  };
  const auto finds_rock = [this, &look](double accurate_m) {
    TerrainParams params;
    params.accurate_m = accurate_m;
    TerrainGrid grid(params);
    for (double from_m = 30.0; from_m > 14.0; from_m -= 0.5) look(&grid, from_m, 0.25);
    for (double from_m = 14.0; from_m > 9.5; from_m -= 0.5) look(&grid, from_m, 0.03);
    const Cell first = grid.patch({Quat::Identity(), Vec3(0.0, 0.0, 1.8)}, &answers_);
    bool found = false;
    for (std::size_t k = 0; k < answers_.size(); ++k) {
      const int i = first.i + static_cast<int>(k) % params.patch;
      const int j = first.j + static_cast<int>(k) / params.patch;
      const double x = (i + 0.5) * params.cell_m;
      const double y = (j + 0.5) * params.cell_m;
      const bool rock = std::hypot(x - 8.0, y) < 0.6;
      found |= rock && answers_[k].obstacle;
      EXPECT_FALSE(answers_[k].obstacle && !rock && std::hypot(x - 8.0, y) > 1.0) << x << " " << y;
    }
    return found;
  };
  EXPECT_TRUE(finds_rock(12.0));
  EXPECT_FALSE(finds_rock(0.0)) << "the test needs more error";
}

// The far side of a ditch is seen lower from farther away than from near, where the rays pass above
// it: what was seen of it remains.
TEST_F(TerrainGridTest, PointsBesideAFaceDoNotFillTheDitchBelowIt) {
  const auto look = [&](bool foot) {
    points_.clear();
    for (int j = -60; j < 60; ++j) {
      const float y = 0.05F * static_cast<float>(j);
      for (int i = 120; i < 260; ++i) {
        if (i < 180 || i >= 199) points_.push_back(Vec3f(0.05F * static_cast<float>(i), y, 0.0F));
      }
      if (foot) points_.push_back(Vec3f(9.9F, y, -0.6F));
    }
    grid_.insert(points_, Pose());
  };
  for (int k = 0; k < 5; ++k) look(true);
  const TerrainAnswer before = at(Pose(), 9.9, 0.0);
  EXPECT_TRUE(before.obstacle);
  for (int k = 0; k < 40; ++k) look(false);
  const TerrainAnswer after = at(Pose(), 9.9, 0.0);
  EXPECT_TRUE(after.obstacle) << "step of " << after.step_m << " m, before " << before.step_m;
}

TEST_F(TerrainGridTest, RemovedObjectsAreCleared) {
  for (int k = 0; k < 5; ++k) scan(T_, true);
  ASSERT_TRUE(at(T_, 10.0, 0.0).obstacle);
  for (int k = 0; k < 40; ++k) scan(T_, false);
  EXPECT_FALSE(at(T_, 10.0, 0.0).obstacle);
}

TEST_F(TerrainGridTest, OverhangsArePassable) {
  for (int k = 0; k < 5; ++k) scan(T_, false);
  points_.clear();
  for (int k = 0; k < 200; ++k) {
    const Vec3 p(8.0 + unit_(rng_), unit_(rng_), ground(8.5) + 3.0 + unit_(rng_));
    points_.push_back((T_.inverse() * p).cast<float>());
  }
  for (int k = 0; k < 5; ++k) grid_.insert(points_, T_);
  EXPECT_FALSE(at(T_, 8.5, 0.5).obstacle);
}

TEST_F(TerrainGridTest, TheWindowMovesAndCyclesAllocateNothing) {
  scan(T_, true);
  (void)grid_.patch(T_, &answers_);
  Pose T = T_;
  for (int k = 0; k < 30; ++k) {
    T.p.x() += 5.0;
    T.p.z() = ground(T.p.x()) + 0.9;
    scan(T, false, 2000);
    const test::HeapGuard guard;
    grid_.insert(points_, T);
    (void)grid_.patch(T, &answers_);
    EXPECT_EQ(guard.allocations(), 0);
  }
  EXPECT_TRUE(at(T, T.p.x() + 6.0, 2.0).known);
  EXPECT_NEAR(at(T, T.p.x() + 6.0, 2.0).height_m, ground(T.p.x() + 6.0), 0.1);
}

// At the near edge of the visible ground the lowest rays graze the grass: the nearer a return, the
// higher it lies.
TEST_F(TerrainGridTest, GrassAtTheNearEdgeGivesNoSlopeAndNoStep) {
  const Pose T(Pose{Quat::Identity(), Vec3(0.0, 0.0, 0.9)});
  for (int k = 0; k < 10; ++k) {
    points_.clear();
    for (int n = 0; n < 6000; ++n) {
      const double x = 3.2 + 15.0 * unit_(rng_);
      const double y = 20.0 * (unit_(rng_) - 0.5);
      const double lowest_ray = 1.8 - x * std::tan(radians(20.0));
      const double blade = 0.5 * unit_(rng_);
      points_.push_back(Vec3(x, y, std::max({0.0, lowest_ray, blade * blade}) - 0.9).cast<float>());
    }
    grid_.insert(points_, T);
  }
  for (double x = 3.4; x < 12.0; x += 0.4) {
    const TerrainAnswer a = at(T, x, 0.2);
    EXPECT_TRUE(a.known) << x;
    EXPECT_FALSE(a.obstacle) << x;
    EXPECT_LT(a.slope_rad, radians(25.0)) << x;
  }
}

// The area ahead of the starting vehicle was never observed from a greater distance: there even
// returns at 6 m are not used as ground, and grass is not a rock. Later they are used.
TEST_F(TerrainGridTest, AtTheStartNearGroundIsNotUsed) {
  const auto is_rock = [&](double x_m) {
    const Pose T(Pose{Quat::Identity(), Vec3(x_m, 0.0, 0.9)});
    for (int k = 0; k < 10; ++k) {
      points_.clear();
      for (int n = 0; n < 3000; ++n) {
        const double x = 5.2 + 5.0 * unit_(rng_);
        const double y = 8.0 * (unit_(rng_) - 0.5);
        const double tuft = std::abs(x - 5.8) < 0.4 && std::abs(y) < 0.5 ? 0.35 : 0.0;
        points_.push_back(Vec3(x, y, tuft + 0.01 * normal_(rng_) - 0.9).cast<float>());
      }
      grid_.insert(points_, T);
    }
    return at(T, x_m + 5.8, 0.1).obstacle;
  };
  EXPECT_FALSE(is_rock(0.0));
  EXPECT_TRUE(is_rock(20.0));
}

// The ground behind a rock is not visible; the rock is detected nevertheless.
TEST_F(TerrainGridTest, ARockIsDetectedWithUnknownGroundBehindIt) {
  const Pose T(Pose{Quat::Identity(), Vec3(0.0, 0.0, 0.9)});
  for (int k = 0; k < 10; ++k) {
    points_.clear();
    for (int n = 0; n < 6000; ++n) {
      const double x = 4.0 + 6.0 * unit_(rng_);
      const double y = 20.0 * (unit_(rng_) - 0.5);
      points_.push_back(Vec3(x, y, 0.02 * normal_(rng_) - 0.9).cast<float>());
    }
    for (int n = 0; n < 60; ++n) {  // its front and its top
      points_.push_back(Vec3(10.0 + 0.3 * unit_(rng_), 0.2 + 0.4 * (unit_(rng_) - 0.5),
                             0.35 - 0.9 + 0.02 * normal_(rng_))
                            .cast<float>());
    }
    grid_.insert(points_, T);
  }
  EXPECT_TRUE(at(T, 10.2, 0.2).obstacle);
  EXPECT_FALSE(at(T, 8.0, 0.2).obstacle);
}

// Seen in the new frame, which begins at the vehicle, level.
TEST_F(TerrainGridTest, TheTerrainAheadMovesToAnotherFrame) {
  scan(T_, true);
  const Points first = points_;
  for (int k = 0; k < 10; ++k) scan(T_, true);
  EXPECT_EQ(grid_.agreement(first, T_).agree, grid_.agreement(first, T_).points);
  EXPECT_GT(grid_.agreement(first, T_).points, 500);
  const Pose turned{exp_so3(Vec3(0.0, 0.0, 1.5)), Vec3::Zero()};
  EXPECT_LT(2 * grid_.agreement(first, turned * T_).agree, grid_.agreement(first, T_).points);

  const Quat turn = exp_so3(Vec3(0.0, 0.0, 0.6));
  const Pose T_old_new{turn, Vec3(0.0, 0.0, 0.9)};
  const Pose T_new_vehicle = T_old_new.inverse() * T_;
  const auto new_place = [&](double x, double y) {
    return Vec3(turn.conjugate() * Vec3(x, y, 0.0));
  };
  const Vec3 plain = new_place(6.0, 3.0);
  const Vec3 box = new_place(10.0, 0.0);
  const Vec3 far = new_place(14.0, 2.0);
  const Pose facing{T_new_vehicle.q, T_new_vehicle.p};
  grid_.keep_ahead(T_old_new, facing);
  EXPECT_NEAR(at(facing, plain.x(), plain.y()).height_m, ground(6.0) - 0.9, 0.1);
  EXPECT_TRUE(at(facing, box.x(), box.y()).obstacle);
  EXPECT_FALSE(at(facing, far.x(), far.y()).known) << "not compared with a scan";
  EXPECT_FALSE(grid_.empty());
}

TEST_F(TerrainGridTest, NothingBehindTheVehicleIsKept) {
  for (int k = 0; k < 10; ++k) scan(T_, false);
  const Pose ahead{T_.q, Vec3(8.0, 0.0, T_.p.z() + ground(8.0))};
  ASSERT_TRUE(at(ahead, 5.0, 1.0).known);
  grid_.keep_ahead(Pose{}, ahead);
  EXPECT_FALSE(at(ahead, 5.0, 1.0).known);
  EXPECT_TRUE(at(ahead, 11.0, 1.0).known);
}

// Against least squares by QR, cell by cell. The size of the patch is not a multiple of the SIMD
// lanes.
TEST(TerrainPatch, IsThePlaneThroughTheNeighbouringKnownCells) {
  TerrainParams params;
  params.patch = 70;
  params.near_m = params.near_start_m = 0.0;
  TerrainGrid grid(params);
  // All known cells have one height, far from zero; on the left few cells are known.
  const Pose T(Pose{Quat::Identity(), Vec3(-7.3, 4.1, 300.0)});
  const int side = params.patch + 4;
  std::vector<TerrainAnswer> answers;
  const Cell first = grid.patch(T, &answers);
  std::mt19937 rng(7);
  std::uniform_real_distribution<> unit(0.0, 1.0);
  Eigen::MatrixXf low_m = Eigen::MatrixXf::Constant(side, side, kUnknown_m);
  Points p_vehicle;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      if (unit(rng) > (2 * i < side ? 0.3 : 0.85)) continue;
      const double rock = unit(rng) < 0.02 ? 0.9 : 0.0;
      const Vec3 p((first.i - 2 + i + 0.25) * params.cell_m,
                   (first.j - 2 + j + 0.25) * params.cell_m,
                   300.0 + 0.05 * i - 0.03 * j + 0.1 * unit(rng) + rock);
      const Vec3f p_seen = (p - T.p).cast<float>();
      if (p_seen.norm() > params.max_range_m) continue;
      p_vehicle.push_back(p_seen);
      low_m(i, j) = static_cast<float>(p_seen.z() + T.p.z());
    }
  }
  for (int k = 0; k < 3; ++k) grid.insert(p_vehicle, T);
  ASSERT_TRUE(grid.patch(T, &answers) == first);
  int planes = 0;
  int unknown = 0;
  for (int j = 0; j < params.patch; ++j) {
    for (int i = 0; i < params.patch; ++i) {
      const TerrainAnswer& a = answers[static_cast<std::size_t>(j * params.patch + i)];
      const Eigen::Matrix<float, 5, 5> around = low_m.block<5, 5>(i, j);
      Eigen::MatrixXd A(0, 3);
      Eigen::VectorXd z(0);
      for (int y = 0; y < 5; ++y) {
        for (int x = 0; x < 5; ++x) {
          if (around(x, y) == kUnknown_m) continue;
          A.conservativeResize(A.rows() + 1, 3);
          z.conservativeResize(z.rows() + 1);
          A.row(A.rows() - 1) << 1.0, x - 2.0, y - 2.0;
          z[z.rows() - 1] = around(x, y);
        }
      }
      const bool self_known = around(2, 2) < kUnknown_m;
      bool few = A.rows() < (self_known ? 6 : 9);
      if (!few && !self_known) {
        const double leverage = (A.transpose() * A).inverse()(0, 0);
        if (std::abs(leverage - 0.5) < 1e-9) continue;
        few = leverage > 0.5;  // the known cells are all on one side
      }
      EXPECT_EQ(a.known, self_known || !few) << i << ' ' << j;
      unknown += a.known ? 0 : 1;
      if (few) continue;
      ++planes;
      const Vec3 plane = A.colPivHouseholderQr().solve(z);
      const double rms = (A * plane - z).norm() / std::sqrt(static_cast<double>(z.rows()));
      EXPECT_NEAR(a.height_m, plane[0], 5e-5);  // a float at 300 m
      EXPECT_NEAR(a.slope_rad, std::atan(plane.tail<2>().norm() / params.cell_m), 2e-5);
      EXPECT_NEAR(a.roughness_m, rms, 1e-6);
    }
  }
  EXPECT_GT(planes, 2000);
  EXPECT_GT(unknown, 500);
}

}  // namespace
}  // namespace rcs::wm
