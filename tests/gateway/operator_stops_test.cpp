#include "modules/gateway/operator_stops.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace rcs::gateway {
namespace {

constexpr Stamp at(double s) { return Stamp() + from_seconds(s); }

/// The latch of BG lists what it has received, if it is not deaf.
struct Bg {
  std::set<std::int64_t> listed;
  std::set<std::string> of_former;  ///< operators of stops of a former gateway
  std::vector<OperatorStops::Stop> sent;

  void cycle(OperatorStops* stops, const std::vector<std::string_view>& engaged, double t_s,
             bool refresh = false, bool deaf = false) {
    const auto is_listed = [this](const OperatorStops::Stop& s) {
      return s.number == 0 ? of_former.count(s.operator_id) > 0 : listed.count(s.number) > 0;
    };
    const auto stop = stops->update(engaged, at(t_s), is_listed, refresh);
    if (!stop) return;
    sent.push_back(*stop);
    if (!deaf) listed.insert(stop->number);
  }
};

TEST(OperatorStops, EachOperatorHasAStopThatIsSentAtOnce) {
  OperatorStops stops;
  Bg bg;
  stops.press("alice", at(0.0));
  bg.cycle(&stops, {"alice"}, 0.0, true);
  stops.press("bob", at(0.3));
  bg.cycle(&stops, {"alice", "bob"}, 0.3);
  ASSERT_EQ(bg.sent.size(), 2U);
  EXPECT_EQ(bg.sent[0].operator_id, "alice");
  EXPECT_EQ(bg.sent[1].operator_id, "bob");
  EXPECT_NE(bg.sent[0].number, bg.sent[1].number);
  stops.press("bob", at(0.5));
  bg.cycle(&stops, {"alice", "bob"}, 0.5);
  EXPECT_EQ(bg.sent.size(), 2U) << "the stop is in force";
  bg.cycle(&stops, {"alice", "bob"}, 1.0, true);
  EXPECT_EQ(bg.sent.back().number, bg.sent[1].number) << "a refreshment";
}

TEST(OperatorStops, AStopThatBgDoesNotListIsSentAgain) {
  OperatorStops stops;
  Bg bg;
  stops.press("alice", at(0.0));
  stops.press("bob", at(0.0));
  bg.cycle(&stops, {"alice", "bob"}, 0.0, true, true);
  bg.cycle(&stops, {"alice", "bob"}, 0.1, false);
  bg.cycle(&stops, {"alice", "bob"}, 1.0, true);
  ASSERT_EQ(bg.sent.size(), 3U);
  EXPECT_EQ(bg.sent[2].number, bg.sent[0].number) << "one stop, one number";
}

// The stop arrives while the release of an authority is under way: BG still lists the former one.
TEST(OperatorStops, AStopDuringAReleaseByAnAuthorityIsAnotherStop) {
  OperatorStops stops;
  Bg bg;
  stops.press("alice", at(0.0));
  bg.cycle(&stops, {"alice"}, 0.0, true);
  bg.cycle(&stops, {"alice"}, 0.1);
  stops.press("alice", at(10.0));
  bg.cycle(&stops, {"alice"}, 10.0);
  bg.listed.clear();
  bg.cycle(&stops, {"alice"}, 10.5);
  ASSERT_EQ(bg.sent.size(), 2U);
  EXPECT_NE(bg.sent[1].number, bg.sent[0].number);
  bg.listed.clear();
  bg.cycle(&stops, {"alice"}, 20.0);
  EXPECT_EQ(bg.sent.size(), 2U) << "released later: she has not stopped again";
}

TEST(OperatorStops, StopsOfAFormerGatewayAreThoseOfTheirOperators) {
  OperatorStops stops;
  Bg bg;
  bg.of_former = {"alice"};
  stops.adopt("alice");
  bg.cycle(&stops, {"alice"}, 0.0, true);
  EXPECT_TRUE(bg.sent.empty()) << "BG has it";
  stops.press("alice", at(1.0));
  bg.cycle(&stops, {"alice"}, 1.0);
  EXPECT_TRUE(bg.sent.empty());
  bg.of_former.clear();
  bg.cycle(&stops, {"alice"}, 1.5);
  ASSERT_EQ(bg.sent.size(), 1U) << "an authority has released it after she has stopped again";
  EXPECT_TRUE(stops.take_ended().empty());

  OperatorStops again;  // DDS still has a stop that the former process has set
  bg.sent.clear();
  bg.of_former = {"alice"};
  again.press("alice", at(0.0));
  again.adopt("alice");
  bg.cycle(&again, {"alice"}, 0.1, true);
  EXPECT_TRUE(bg.sent.empty()) << "one stop in the latch, however often the gateway restarts";

  OperatorStops later;
  bg.of_former = {"alice", "bob"};
  later.adopt("alice");
  later.adopt("bob");
  bg.cycle(&later, {"alice", "bob"}, 0.0);
  bg.of_former = {"bob"};
  bg.cycle(&later, {"alice", "bob"}, 9.0);
  EXPECT_EQ(later.take_ended(), std::vector<std::string>{"alice"}) << "released by an authority";
}

}  // namespace
}  // namespace rcs::gateway
