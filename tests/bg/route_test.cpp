#include <gtest/gtest.h>

#include <limits>

#include "modules/bg/bg_messages_node.h"

namespace rcs::bg {
namespace {

command_t order(int waypoints, std::int64_t task) {
  command_t m{};
  m.issuer = "operator";
  m.kind = command_t::KIND_GOTO;
  m.task = task;
  m.n = waypoints;
  m.waypoint.resize(static_cast<std::size_t>(waypoints));
  for (int k = 0; k < waypoints; ++k) {
    waypoint_t& w = m.waypoint[static_cast<std::size_t>(k)];
    w.p_m[0] = 10.0 * k;
    w.radius_m = 3.0;
    w.speed_mps = 5.0;
  }
  return m;
}

TEST(Route, TheSameTaskContinuesAndANewTaskStartsOver) {
  Route route;
  EXPECT_TRUE(route.arrived());
  EXPECT_EQ(route.take(order(3, 1)), "");
  route.pass();
  const int number = route.number();
  EXPECT_EQ(route.take(order(3, 1)), "");
  EXPECT_EQ(route.number(), number);
  EXPECT_EQ(route.done(), 1);

  // The progress that the superior received from an earlier BG counts, but it never decreases.
  command_t known = order(3, 1);
  known.waypoints_done = 2;
  EXPECT_EQ(route.take(known), "");
  EXPECT_EQ(route.done(), 2);
  EXPECT_EQ(route.take(order(3, 1)), "");
  EXPECT_EQ(route.done(), 2);

  EXPECT_EQ(route.take(order(3, 2)), "");
  EXPECT_EQ(route.done(), 0);
  EXPECT_NE(route.number(), number);
  EXPECT_EQ(route.take(known), "");
  EXPECT_EQ(route.done(), 2);
  EXPECT_EQ(route.next().p_m[0], 20.0);
}

TEST(Route, ADifferentCommandIsADifferentTask) {
  const auto begins_anew = [](const command_t& m) {
    Route route;
    (void)route.take(order(3, 1));
    route.pass();
    EXPECT_EQ(route.take(m), "");
    return route.done() == 0;
  };
  EXPECT_FALSE(begins_anew(order(3, 1)));
  command_t m = order(3, 1);
  m.waypoint[1].p_m[1] = 1.0;  // the next one
  EXPECT_TRUE(begins_anew(m));
  m = order(3, 1);
  m.issuer = "gateway";
  EXPECT_TRUE(begins_anew(m));
  m = order(3, 1);
  m.frame = command_t::FRAME_LOCAL;
  EXPECT_TRUE(begins_anew(m));
  m = order(3, 0);
  EXPECT_TRUE(begins_anew(m));
  m = order(3, 1);
  m.frame = command_t::FRAME_ROLLING;
  EXPECT_TRUE(begins_anew(m));
}

TEST(Route, ALongRouteComesInPartsWithoutAStop) {
  Route route;
  EXPECT_EQ(route.take(order(10, 1)), "");
  for (int k = 0; k < 6; ++k) route.pass();
  const int number = route.number();
  // The next part begins before the waypoint that is driven to, and goes on behind the last one.
  command_t part = order(14, 1);
  part.waypoint.erase(part.waypoint.begin(), part.waypoint.begin() + 4);
  part.n = 10;
  EXPECT_EQ(route.take(part), "");
  EXPECT_EQ(route.number(), number) << "the same route";
  EXPECT_EQ(route.size(), 10);
  EXPECT_EQ(route.done(), 2);
  EXPECT_EQ(route.next().p_m[0], 60.0);
}

TEST(Route, ARouteInFrameRollingBelongsToAMapEpoch) {
  Route route;
  command_t m = order(5, 1);
  EXPECT_EQ(route.take(m), "");
  EXPECT_FALSE(route.map_epoch());
  m.frame = command_t::FRAME_ROLLING;
  m.map_epoch = 7;
  EXPECT_EQ(route.take(m), "");
  EXPECT_EQ(route.map_epoch(), 7);
  route.pass();
  m.map_epoch = 8;
  EXPECT_EQ(route.take(m), "");
  EXPECT_EQ(route.done(), 0) << "the same coordinates are other places";
  EXPECT_EQ(route.ahead(0, 12.0), 2U);
  EXPECT_EQ(route.ahead(3, 100.0), 4U);
}

TEST(Route, AnInvalidCommandIsRejectedAndClearsTheRoute) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const command_t& m) {
    Route route;
    (void)route.take(order(3, 1));
    const bool reason = route.take(m).substr(0, 17) == "command rejected:";
    EXPECT_TRUE(route.arrived());
    EXPECT_EQ(route.size(), 0);
    return reason;
  };
  const auto with = [](auto change) {
    command_t m = order(3, 1);
    change(&m);
    return m;
  };
  EXPECT_TRUE(refused(order(0, 1)));
  EXPECT_TRUE(refused(order(kMaxWaypoints + 1, 1)));
  EXPECT_TRUE(refused(with([](command_t* m) { m->frame = 9; })));
  EXPECT_TRUE(refused(with([](command_t* m) { m->waypoints_done = -1; })));
  EXPECT_TRUE(refused(with([](command_t* m) { m->waypoints_done = 4; })));
  EXPECT_TRUE(refused(with([&](command_t* m) { m->waypoint[1].p_m[2] = nan; })));
  EXPECT_TRUE(refused(with([&](command_t* m) { m->waypoint[1].radius_m = nan; })));
  EXPECT_TRUE(refused(with([&](command_t* m) { m->waypoint[1].speed_mps = nan; })));
  EXPECT_TRUE(refused(with([](command_t* m) { m->waypoint[0].p_m[0] = 1e7; })));
  EXPECT_TRUE(refused(with([](command_t* m) { m->waypoint[0].speed_mps = 31.0; })));
}

}  // namespace
}  // namespace rcs::bg
