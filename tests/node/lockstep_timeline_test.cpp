#include "rcs/node/timeline/lockstep_timeline.h"

#include <gtest/gtest.h>

#include "rcs/node/executor.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::Echo;
using test::ListSource;
using test::ms;
using test::odometry_items;

TEST(LockstepTimeline, AnOutputIsVisibleAfterTheNominalComputeTime) {
  // GIVEN two nodes in a chain, of 30 ms and 2 ms
  LocalBus bus;
  Echo first({"first", ms(50), ms(30)}, &bus, "ODOMETRY", "MIDDLE");
  Echo second({"second", ms(50), ms(2)}, &bus, "MIDDLE", "END");
  Inbox<odometry_t> end(&bus, "END", 8);
  ListSource source(odometry_items(at_ms(1000), ms(100), 3));
  LockstepTimeline timeline(&bus, &source, ms(500));
  run({&first, &second}, timeline, nullptr);
  // THEN each hop is delayed by exactly its own compute time
  ASSERT_EQ(second.seen.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const Stamp sent = at_ms(1000 + 100 * static_cast<std::int64_t>(i));
    EXPECT_EQ(first.seen[i].arrival, sent);
    EXPECT_EQ(second.seen[i].arrival, sent + ms(30));
    EXPECT_EQ(end.front_arrival(), sent + ms(32));
    end.pop();
  }
}

TEST(LockstepTimeline, ABusyNodeStartsAgainWhenItsOutputIsDelivered) {
  // Messages arrive every 10 ms, a cycle lasts 25 ms: cycles start at 0, 25, 50, 75 and 100.
  LocalBus bus;
  Echo node({"node", ms(10), ms(25)}, &bus, "ODOMETRY", "END");
  ListSource source(odometry_items(at_ms(0), ms(10), 10));
  LockstepTimeline timeline(&bus, &source, ms(500));
  const RunReport report = run({&node}, timeline, nullptr);
  EXPECT_EQ(report.nodes[0].cycles, 5);
  EXPECT_EQ(node.seen.back().cycle.now, at_ms(100));
  EXPECT_EQ(node.seen.size(), 10U);
}

TEST(LockstepTimeline, PendingWorkIsFinishedAfterTheLastEvent) {
  // The last of 3 messages at 20 ms waits until the node is free at 50 ms, and its output is
  // delivered at 100 ms.
  LocalBus bus;
  Echo node({"node", ms(10), ms(50)}, &bus, "ODOMETRY", "END");
  Inbox<odometry_t> end(&bus, "END", 8);
  ListSource source(odometry_items(at_ms(0), ms(10), 3));
  LockstepTimeline timeline(&bus, &source, ms(40));
  run({&node}, timeline, nullptr);
  EXPECT_EQ(end.account().received, 3);
  EXPECT_EQ(end.account().last_arrival, at_ms(100))
      << "delivered at its due time after the last event";
}

TEST(LockstepTimeline, EventsThatStepBackAreDeliveredAtTheTimeReachedAndCounted) {
  LocalBus bus;
  Inbox<odometry_t> inbox(&bus, "ODOMETRY", 8);
  std::vector<ListSource::Item> items = odometry_items(at_ms(100), ms(10), 3);
  items[1].due = at_ms(40);
  items[2].due = at_ms(99);
  ListSource source(items);
  LockstepTimeline timeline(&bus, &source, ms(10));
  while (timeline.advance(Stamp::max()) != Timeline::Step::kEnded) {
  }
  EXPECT_EQ(inbox.account().received, 3);
  EXPECT_EQ(inbox.account().last_arrival, at_ms(100));
  EXPECT_EQ(timeline.stepped_back(), 2);
}

TEST(LockstepTimeline, MessagesDueNowAreDeliveredBeforeAnOverdueCycle) {
  LocalBus bus;
  Inbox<odometry_t> inbox(&bus, "ODOMETRY", 8);
  ListSource source(odometry_items(at_ms(100), ms(10), 3));
  LockstepTimeline timeline(&bus, &source, ms(10));
  EXPECT_EQ(timeline.advance(Stamp::min()), Timeline::Step::kDelivered);
  EXPECT_EQ(timeline.advance(Stamp::min()), Timeline::Step::kReached);
  EXPECT_EQ(timeline.now(), at_ms(100));
}

TEST(LockstepTimeline, AnEmptySourceEnds) {
  LocalBus bus;
  ListSource source({});
  LockstepTimeline timeline(&bus, &source, ms(10));
  EXPECT_EQ(timeline.advance(Stamp::max()), Timeline::Step::kEnded);
}

}  // namespace
}  // namespace rcs
