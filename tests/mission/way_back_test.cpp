#include "modules/mission/way_back.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rcs::mission {
namespace {

Breadcrumb at(double x_m, double y_m, std::int32_t epoch = 3, bool in_world = true) {
  // The origins of the frames differ.
  return {Vec3(x_m, y_m, 0.0), epoch, Vec3(x_m + 100.0, y_m, 0.0), in_world};
}

TEST(WayBack, LeadsFromHereToTheStart) {
  WayBack way;
  for (double x = 0.0; x <= 300.0; x += 0.5) way.note(at(x, 0.0));
  const WayPart part = way.first_part(3);
  ASSERT_TRUE(part.rolling);
  ASSERT_EQ(part.places.size(), 201U);
  EXPECT_EQ(part.places.front(), Vec3(300.0, 0.0, 0.0));
  EXPECT_EQ(part.places.back(), Vec3(0.0, 0.0, 0.0));
}

TEST(WayBack, LoopsAreLeftOut) {
  WayBack way;
  for (double x = 0.0; x <= 100.0; x += 1.0) way.note(at(x, 0.0));
  for (double a = 0.0; a <= 6.3; a += 0.02) {  // back to (100, 0)
    way.note(at(100.0 + 40.0 * std::sin(a), 40.0 * (1.0 - std::cos(a))));
  }
  for (double x = 100.0; x <= 200.0; x += 1.0) way.note(at(x, -2.0));
  const WayPart part = way.first_part(3);
  double length = 0.0;
  for (std::size_t k = 1; k < part.places.size(); ++k) {
    length += (part.places[k] - part.places[k - 1]).norm();
  }
  EXPECT_NEAR(length, 200.0, 8.0);
  EXPECT_EQ(part.places.back(), Vec3(0.0, 0.0, 0.0));
}

TEST(WayBack, ReversalsAreLeftOut) {
  WayBack way;
  for (double x = 0.0; x <= 60.0; x += 0.5) way.note(at(x, 0.0));
  for (double x = 60.0; x >= 52.0; x -= 0.5) way.note(at(x, 0.3));
  for (double x = 52.0; x <= 100.0; x += 0.5) way.note(at(x, 0.1));
  const WayPart part = way.first_part(3);
  for (std::size_t k = 1; k < part.places.size(); ++k) {
    EXPECT_LT(part.places[k].x(), part.places[k - 1].x()) << k;
  }
  EXPECT_EQ(part.places.back(), Vec3(0.0, 0.0, 0.0));
}

TEST(WayBack, WhatWasDrivenInAnotherMapFollowsInFrameWorld) {
  WayBack way;
  for (double x = 0.0; x <= 60.0; x += 1.0) way.note(at(x, 0.0, 3));
  for (double x = 60.0; x <= 120.0; x += 1.0) way.note(at(x, 0.0, 4));
  WayPart part = way.first_part(4);
  ASSERT_TRUE(part.rolling);
  EXPECT_GE(part.places.back().x(), 60.0);
  EXPECT_LE(part.places.back().x(), 66.0);
  way.begin_return(at(60.0, 0.0, 3));
  part = way.first_part(4);
  EXPECT_FALSE(part.rolling);
  EXPECT_EQ(part.places.back(), Vec3(100.0, 0.0, 0.0)) << "frame world";
}

TEST(WayBack, WithoutAPositionInFrameWorldItEndsWithTheMap) {
  WayBack way;
  for (double x = 0.0; x <= 60.0; x += 1.0) way.note(at(x, 0.0, 3, false));
  EXPECT_TRUE(way.first_part(4).places.empty());
  EXPECT_FALSE(way.first_part(3).places.empty());
}

TEST(WayBack, TheWayThatWasDrivenBackIsForgotten) {
  WayBack way;
  for (double x = 0.0; x <= 300.0; x += 1.0) way.note(at(x, 0.0));
  EXPECT_NEAR(way.begin_return(at(151.0, 2.0)), std::hypot(1.0, 2.0), 1e-9);
  EXPECT_EQ(way.first_part(3).places.front(), Vec3(152.0, 0.0, 0.0));
}

// The vehicle drives back next to its way, and is then given another task.
TEST(WayBack, AnInterruptedReturnIsContinuedWhereItEnded) {
  for (const double lateral_m : {0.0, 1.2, 2.5}) {
    WayBack way;
    for (double x = 0.0; x <= 300.0; x += 1.0) way.note(at(x, 0.0));
    way.begin_return(at(300.0, 0.0));
    for (double x = 150.0; x <= 160.0; x += 1.0) way.note(at(x, lateral_m));
    const WayPart part = way.first_part(3);
    ASSERT_TRUE(part.to_the_start) << lateral_m;
    EXPECT_EQ(part.places.back(), Vec3(0.0, 0.0, 0.0));
    double length_m = 0.0;
    for (std::size_t k = 1; k < part.places.size(); ++k) {
      const double step_m = (part.places[k] - part.places[k - 1]).norm();
      EXPECT_LT(step_m, 3.2) << lateral_m;
      length_m += step_m;
    }
    EXPECT_NEAR(length_m, 160.0, 4.0) << lateral_m;
  }
}

TEST(WayBack, InAnotherFrameWorldItsPlacesAreWhereTheyWere) {
  WayBack way;
  for (double x = 0.0; x <= 60.0; x += 2.0) way.note(at(x, 0.0, 3));
  way.move_world({Quat::Identity(), Vec3(-30.0, 5.0, 0.0)});
  const WayPart part = way.first_part(4);
  ASSERT_FALSE(part.rolling);
  EXPECT_EQ(part.places.front(), Vec3(130.0, 5.0, 0.0));
  EXPECT_EQ(part.places.back(), Vec3(70.0, 5.0, 0.0));
  EXPECT_EQ(way.first_part(3).places.back(), Vec3(0.0, 0.0, 0.0)) << "frame rolling";
}

TEST(WayBack, ALongWayKeepsItsStart) {
  WayBack way;
  for (double x = 0.0; x < 100'000.0; x += 2.0) way.note(at(x, 0.0));
  EXPECT_LE(way.crumbs().size(), WayBack::kMaxCrumbs);
  EXPECT_EQ(way.crumbs().front().p_rolling.x(), 0.0);
}

}  // namespace
}  // namespace rcs::mission
