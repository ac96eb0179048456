#include "modules/gateway/node_status_table.h"

#include <gtest/gtest.h>

namespace rcs::gateway {
namespace {

constexpr Stamp at(double s) { return Stamp() + from_seconds(s); }

TEST(NodeStatusTable, ReportsEverySecondAndAtOnceOnChange) {
  NodeStatusTable table({"wm"}, NodeStatusParams{});
  table.receive(0, at(0.0));
  EXPECT_TRUE(table.take_due(0, at(0.0)));
  EXPECT_FALSE(table.take_due(0, at(0.0))) << "published once";
  EXPECT_FALSE(table.take_due(0, at(0.95)));
  EXPECT_TRUE(table.take_due(0, at(1.0)));
  table.facts(0).cycles = 50;
  EXPECT_FALSE(table.take_due(0, at(1.5))) << "a counter is no change";
  table.facts(0).state = "lost";
  EXPECT_TRUE(table.take_due(0, at(1.5)));
  table.facts(0).degrade_level = 2;
  EXPECT_FALSE(table.take_due(0, at(1.55)))
      << "a flickering status is published ten times a second at most";
  EXPECT_TRUE(table.take_due(0, at(1.6)));
}

TEST(NodeStatusTable, SilenceIsAChange) {
  NodeStatusTable table({"wm", "sp"}, NodeStatusParams{});
  EXPECT_EQ(table.age(1, at(5.0)), Duration(-1));
  EXPECT_FALSE(table.alive(1, at(5.0)));
  table.receive(0, at(5.0));
  EXPECT_TRUE(table.take_due(0, at(7.4)));
  EXPECT_TRUE(table.alive(0, at(7.5)));
  EXPECT_EQ(table.age(0, at(7.5)), from_seconds(2.5));
  EXPECT_TRUE(table.take_due(0, at(7.55))) << "no longer alive";
  EXPECT_FALSE(table.alive(0, at(7.55)));
}

}  // namespace
}  // namespace rcs::gateway
