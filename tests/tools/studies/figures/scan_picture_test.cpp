#include "tools/studies/figures/scan_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace rcs::studies {
namespace {

using report::Colour;
using report::Plot;
using report::Projection;
using report::Series;
using report::Window;

/// 4 x 8 cells of 10 deg each: 40 deg to the left and right, 10 deg down to 30 deg up.
ImageShape small_image() {
  return {4, 8, radians(40.0), radians(80.0), radians(-10.0), radians(40.0)};
}

Vec3f at(double azimuth_deg, double elevation_deg, double range_m) {
  const double a = radians(azimuth_deg);
  const double e = radians(elevation_deg);
  return (range_m * Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)))
      .cast<float>();
}

Points points_of(const std::vector<Vec3f>& list) {
  Points points;
  for (const Vec3f& p : list) points.push_back(p);
  return points;
}

TEST(RangeImagePicture, ACellHasItsNearestReturn) {
  const Points scan = points_of({at(35.0, -5.0, 20.0),    // lowest row, left column
                                 at(36.0, -4.0, 10.0),    // the same cell
                                 at(-35.0, 25.0, 30.0),   // highest row, right column
                                 at(5.0, 5.0, 99.0),      // beyond the limits
                                 at(50.0, 0.0, 10.0),     // left of the image
                                 at(0.0, -20.0, 10.0)});  // below
  const Plot plot = range_image("scan", scan, small_image(), {5.0, 50.0});
  ASSERT_TRUE(plot.map);
  const std::vector<report::CellMap::Cell>& cells = plot.map->cells;
  ASSERT_EQ(cells.size(), 3U);
  EXPECT_EQ(cells[0].j, 0);
  EXPECT_EQ(cells[0].i, 0);
  EXPECT_NEAR(cells[0].value, 10.0, 1e-5);
  EXPECT_EQ(cells[1].j, 1);
  EXPECT_EQ(cells[1].i, 3);
  EXPECT_NEAR(cells[1].value, 50.0, 1e-12);
  EXPECT_EQ(cells[2].j, 3);
  EXPECT_EQ(cells[2].i, 7);
  EXPECT_NEAR(cells[2].value, 30.0, 1e-5);
  EXPECT_TRUE(plot.equal_scales);
}

TEST(RangeImagePicture, LimitsAreInBothImages) {
  // A return in every cell of each, from 5 m and from 15 m on; and returns outside of the image.
  Points near;
  Points far;
  double range_m = 0.0;
  for (int col = 0; col < 8; ++col) {
    for (int row = 0; row < 4; ++row) {
      near.push_back(at(35.0 - 10.0 * col, 10.0 * row - 5.0, 5.0 + range_m));
      far.push_back(at(35.0 - 10.0 * col, 10.0 * row - 5.0, 15.0 + range_m));
      range_m += 1.0;
    }
  }
  far.push_back(at(90.0, 0.0, 1.0));
  near.push_back(at(90.0, 0.0, 99.0));
  const RangeLimits limits = common_limits(near, far, small_image());
  EXPECT_NEAR(limits.low_m, 15.0, 1e-5);  // float
  EXPECT_NEAR(limits.high_m, 36.0, 1e-5);
  for (const Points* scan : {&near, &far}) {
    const Plot plot = range_image("scan", *scan, small_image(), limits);
    double low = 1e9;
    double high = 0.0;
    for (const report::CellMap::Cell& c : plot.map->cells) {
      low = std::min(low, c.value);
      high = std::max(high, c.value);
    }
    EXPECT_EQ(low, limits.low_m);
    EXPECT_EQ(high, limits.high_m);
  }
  EXPECT_EQ(common_limits(Points{}, near, small_image()).high_m, 0.0);
}

TEST(VehicleOutline, MovesWithItsLadar) {
  VehicleShape vehicle;
  vehicle.T_ladar_vehicle.p = Vec3(-1.0, 0.0, -1.0);
  vehicle.front = 2.0;
  vehicle.rear = -2.0;
  vehicle.half_width = 0.8;
  vehicle.roof = 0.5;
  vehicle.ground = -1.0;
  vehicle.front_axle = 1.2;
  vehicle.rear_axle = -1.2;
  const auto extent = [&](const Pose& T, Projection projection) {
    const Series s = vehicle_outline("vehicle", Colour::kBlue, vehicle, T, projection);
    Window w{1e9, -1e9, 1e9, -1e9};
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (!std::isfinite(s.x[i])) continue;
      w = {std::min(w.x_low, s.x[i]), std::max(w.x_high, s.x[i]), std::min(w.y_low, s.y[i]),
           std::max(w.y_high, s.y[i])};
    }
    return w;
  };
  const Window above = extent(Pose{}, Projection::kAbove);
  EXPECT_NEAR(above.x_low, -3.0, 1e-12);
  EXPECT_NEAR(above.x_high, 1.0, 1e-12);
  EXPECT_NEAR(above.y_high, 0.8, 1e-12);
  const Window side = extent(Pose{}, Projection::kSide);
  EXPECT_NEAR(side.y_low, -2.0, 1e-12);  // the wheels are on the ground
  EXPECT_NEAR(side.y_high, -0.5, 1e-12);
  // A quarter turn to the left, and 10 m forward.
  const Window turned =
      extent({exp_so3(Vec3(0.0, 0.0, 0.5 * kPi)), Vec3(10.0, 0.0, 0.0)}, Projection::kAbove);
  EXPECT_NEAR(turned.x_low, 9.2, 1e-12);
  EXPECT_NEAR(turned.x_high, 10.8, 1e-12);
  EXPECT_NEAR(turned.y_low, -3.0, 1e-12);
  EXPECT_NEAR(turned.y_high, 1.0, 1e-12);
}

TEST(PairLines, JoinTheirPointsAndNoOthers) {
  const Points from = points_of({Vec3f(1, 2, 3), Vec3f(4, 5, 6)});
  const Points to = points_of({Vec3f(1, 3, 5), Vec3f(4, 4, 4)});
  const Series above = pair_lines("pair", Colour::kOrange, from, to, Projection::kAbove);
  const Series side = pair_lines("pair", Colour::kOrange, from, to, Projection::kSide);
  ASSERT_EQ(above.x.size(), 6U);
  EXPECT_EQ(above.x[0], 1.0);
  EXPECT_EQ(above.y[0], 2.0);
  EXPECT_EQ(above.y[1], 3.0);
  EXPECT_FALSE(std::isfinite(above.y[2]));
  EXPECT_EQ(above.x[3], 4.0);
  EXPECT_EQ(side.y[3], 6.0);
  EXPECT_EQ(side.y[4], 4.0);
  // A plot omits vertices of a line of more than 4000: it would join other points.
  Points many;
  for (int k = 0; k < 9000; ++k) many.push_back(Vec3f(0.1F * static_cast<float>(k), 0, 0));
  const Series thinned = pair_lines("pair", Colour::kOrange, many, many, Projection::kAbove);
  EXPECT_LT(thinned.x.size(), 4000U);
  for (std::size_t i = 0; i + 2 < thinned.x.size(); i += 3) {
    EXPECT_EQ(thinned.x[i], thinned.x[i + 1]);
    EXPECT_FALSE(std::isfinite(thinned.x[i + 2]));
  }
}

TEST(ScanPicture, AMovedCloudComesBack) {
  const Points points = points_of({Vec3f(1, 2, 3), Vec3f(-4, 5, 0)});
  const Pose T{exp_so3(Vec3(0.1, -0.2, 1.0)), Vec3(3.0, -1.0, 0.5)};
  const Points back = moved(moved(points, T), T.inverse());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((back[i] - points[i]).norm(), 1e-5F);  // float
  }
}

TEST(DetailWindow, ShowsTheStructureOfBothClouds) {
  Points ground;
  for (int i = 0; i < 80; ++i) {
    for (int j = 0; j < 80; ++j) {
      ground.push_back(0.5F * Vec3f(static_cast<float>(i), static_cast<float>(j), 0.0F));
    }
  }
  const auto with_wall = [&](float x) {
    Points out = ground;
    for (int i = 0; i < 40; ++i) {
      for (int k = 1; k < 10; ++k) {
        out.push_back(Vec3f(x, 20.0F + 0.1F * static_cast<float>(i), 0.3F * static_cast<float>(k)));
      }
    }
    return out;
  };
  // The wall at x = 30 is in one cloud only; that at x = 12 is in both.
  Points one = with_wall(12.0F);
  const Points other = one;
  const Points more = with_wall(30.0F);
  for (std::size_t i = 0; i < more.size(); ++i) one.push_back(more[i]);
  const Window w = detail_window(one, other, 6.0, 5.0);
  EXPECT_NEAR(w.x_high - w.x_low, 6.0, 1e-9);
  EXPECT_NEAR(w.y_high - w.y_low, 5.0, 1e-9);
  EXPECT_TRUE(inside(w, Vec3f(12.0F, 22.0F, 1.0F)));
  EXPECT_FALSE(inside(w, Vec3f(30.0F, 22.0F, 1.0F)));
  EXPECT_GT(inside(w, one).size(), 300U);
  // Without any structure: where there are points.
  const Window flat = detail_window(ground, ground, 6.0, 5.0);
  EXPECT_GE(inside(flat, ground).size(), 100U);
}

}  // namespace
}  // namespace rcs::studies
