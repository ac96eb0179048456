#include "modules/wm/terrain/moving_objects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/heap_guard.h"

namespace rcs::wm {
namespace {

constexpr double kCell_m = 0.2;

/// The cells of a face of 0.6 m across y.
std::vector<Cell> face_at(double x_m, double y_m) {
  std::vector<Cell> cells;
  for (int k = -1; k <= 1; ++k) {
    cells.push_back({static_cast<int>(std::floor(x_m / kCell_m)),
                     static_cast<int>(std::floor(y_m / kCell_m)) + k});
  }
  return cells;
}

class MovingObjectsTest : public testing::Test {
 protected:
  /// @param gone  whether nothing stands any more where something stood before
  void scan(const std::vector<Cell>& cells, bool gone, bool free = false) {
    time_s_ += 0.1;
    const test::HeapGuard guard;
    objects_.observe(
        cells, time_s_, [&](Cell) { return !gone; }, [&](const Vec2&) { return free; });
    EXPECT_EQ(guard.allocations(), 0);
  }
  void walk(double speed_mps, int scans) {
    for (int k = 0; k < scans; ++k) {
      y_m_ += 0.1 * speed_mps;
      scan(face_at(10.0, y_m_), true);
    }
  }

  MovingObjects objects_{kCell_m, 500};
  double time_s_ = 100.0;
  double y_m_ = 0.0;
};

TEST_F(MovingObjectsTest, AWalkerMovesAndItsWayIsPredicted) {
  for (const double speed_mps : {0.5, 1.2, 3.0, -2.0}) {
    objects_ = MovingObjects(kCell_m, 500);
    y_m_ = 0.0;
    walk(speed_mps, 15);
    ASSERT_EQ(objects_.objects().size(), 1U);
    const MovingObject& o = objects_.objects()[0];
    EXPECT_TRUE(o.moves);
    EXPECT_NEAR(o.v.y(), speed_mps, 0.15 + 0.05 * std::abs(speed_mps));
    EXPECT_NEAR(o.v.x(), 0.0, 0.1);
    const double reach_m = 3.0 * speed_mps;
    EXPECT_LE(o.distance({10.1, y_m_ + 0.8 * reach_m}, time_s_, 3.0), 0.0);
    EXPECT_GT(o.distance({10.1, y_m_ + 1.5 * reach_m}, time_s_, 3.0), 0.3);
    EXPECT_GT(o.distance({10.1, y_m_ - 0.8 * reach_m}, time_s_, 3.0), 0.5);
    EXPECT_GT(o.distance({11.5, y_m_ + 0.5 * reach_m}, time_s_, 3.0), 0.5);
  }
}

// Another part of a bush is seen from another place, but no ray passes where it was seen.
TEST_F(MovingObjectsTest, WhatIsSeenFromAnotherPlaceDoesNotMove) {
  for (int k = 0; k < 20; ++k) scan(face_at(10.0, 0.1 * k), false);
  for (const MovingObject& o : objects_.objects()) EXPECT_FALSE(o.moves);
}

TEST_F(MovingObjectsTest, OutOfViewItGoesOnUntilRaysPass) {
  walk(1.5, 15);
  for (int k = 0; k < 40; ++k) scan({}, true);
  ASSERT_EQ(objects_.objects().size(), 1U);
  EXPECT_LE(objects_.objects()[0].distance({10.1, y_m_ + 4.0 * 1.5}, time_s_, 0.1), 0.0);
  for (int k = 0; k < 9; ++k) scan({}, true, true);
  EXPECT_TRUE(objects_.objects().empty());
  walk(1.5, 15);
  for (int k = 0; k < 62; ++k) scan({}, true);
  EXPECT_TRUE(objects_.objects().empty()) << "after 6 s it may be anywhere";
}

TEST_F(MovingObjectsTest, TwoThatAreApartAreTwo) {
  for (int k = 0; k < 10; ++k) {
    std::vector<Cell> cells = face_at(10.0, 0.1 * k);
    for (const Cell c : face_at(10.0, 4.0 - 0.1 * k)) cells.push_back(c);
    for (int n = 0; n < 60; ++n) cells.push_back({n, 100});  // a wall of 12 m is none of them
    scan(cells, true);
  }
  ASSERT_EQ(objects_.objects().size(), 2U);
  EXPECT_GT(objects_.objects()[0].v.y(), 0.7);
  EXPECT_LT(objects_.objects()[1].v.y(), -0.7);
}

}  // namespace
}  // namespace rcs::wm
