#include "modules/gateway/node_status_table.h"

#include <gtest/gtest.h>

namespace rcs::gateway {
namespace {

constexpr Stamp at(double s) { return Stamp() + from_seconds(s); }

TEST(NodeStatusTable, ReportsEverySecondAndAtOnceOnChange) {
  NodeBoard board({"wm"}, BoardParams{});
  board.hear(0, at(0.0));
  EXPECT_TRUE(board.take_due(0, at(0.0)));
  EXPECT_FALSE(board.take_due(0, at(0.0))) << "published once";
  EXPECT_FALSE(board.take_due(0, at(0.95)));
  EXPECT_TRUE(board.take_due(0, at(1.0)));
  board.facts(0).cycles = 50;
  EXPECT_FALSE(board.take_due(0, at(1.5))) << "a counter is no change";
  board.facts(0).state = "lost";
  EXPECT_TRUE(board.take_due(0, at(1.5)));
  board.facts(0).degrade_level = 2;
  EXPECT_FALSE(board.take_due(0, at(1.55)))
      << "a flickering status is published ten times a second at most";
  EXPECT_TRUE(board.take_due(0, at(1.6)));
}

TEST(NodeStatusTable, SilenceIsAChange) {
  NodeBoard board({"wm", "sp"}, BoardParams{});
  EXPECT_EQ(board.age(1, at(5.0)), Duration(-1));
  EXPECT_FALSE(board.alive(1, at(5.0)));
  board.hear(0, at(5.0));
  EXPECT_TRUE(board.take_due(0, at(7.4)));
  EXPECT_TRUE(board.alive(0, at(7.5)));
  EXPECT_EQ(board.age(0, at(7.5)), from_seconds(2.5));
  EXPECT_TRUE(board.take_due(0, at(7.55))) << "no longer alive";
  EXPECT_FALSE(board.alive(0, at(7.55)));
}

}  // namespace
}  // namespace rcs::gateway
