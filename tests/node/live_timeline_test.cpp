// On a private bus (with_bus.sh). Real time passes here; the assertions concern order and count,
// and times only as lower bounds.
#include "rcs/node/timeline/live_timeline.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <thread>

#include "rcs/node/executor.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::Echo;
using test::ms;
using test::odometry;

class LiveTimelineTest : public testing::Test {
 protected:
  static std::unique_ptr<LcmBus> open_bus() {
    Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
    EXPECT_TRUE(bus.ok()) << bus.error().message;
    return std::move(bus).value();
  }
  // A pending signal must not affect the next test.
  ~LiveTimelineTest() override {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    const timespec at_once{};
    while (sigtimedwait(&set, nullptr, &at_once) > 0) {
    }
  }

  StopSignals stop_;  // before the bus: its thread inherits the mask
  std::unique_ptr<LcmBus> bus_ = open_bus();
  LiveTimeline timeline_{bus_.get(), &stop_};
};

TEST_F(LiveTimelineTest, ReachesTheMomentAndNeverEarlier) {
  const Stamp until = timeline_.now() + ms(20);
  EXPECT_EQ(timeline_.advance(until), Timeline::Step::kReached);
  EXPECT_GE(timeline_.now(), until);
  EXPECT_EQ(timeline_.advance(until), Timeline::Step::kReached) << "a moment in the past, again";
  EXPECT_EQ(timeline_.advance(Stamp::min()), Timeline::Step::kReached);
}

TEST_F(LiveTimelineTest, DeliversBeforeTheMoment) {
  Inbox<odometry_t> inbox(bus_.get(), "ODOMETRY", 4);
  Outbox<odometry_t> outbox(bus_.get(), "ODOMETRY");
  odometry_t m{};
  const Stamp before = timeline_.now();
  outbox.publish(&m);
  EXPECT_EQ(timeline_.advance(Stamp::max()), Timeline::Step::kDelivered);
  EXPECT_GE(inbox.account().last_arrival, before - ms(1)) << "two clocks, read one after the other";
  EXPECT_LE(inbox.account().last_arrival, timeline_.now());
}

TEST_F(LiveTimelineTest, ASignalEndsIt) {
  ASSERT_EQ(kill(getpid(), SIGTERM), 0);
  EXPECT_EQ(timeline_.advance(Stamp::max()), Timeline::Step::kEnded);
  EXPECT_EQ(timeline_.advance(timeline_.now()), Timeline::Step::kEnded) << "the end is permanent";
}

TEST_F(LiveTimelineTest, AFloodDoesNotStarveAPeriodicNode) {
  // GIVEN a thread that publishes without pause  WHEN a cycle is due  THEN the cycle runs.
  Inbox<odometry_t> inbox(bus_.get(), "ODOMETRY", 4);
  std::atomic<bool> flooding{true};
  std::thread flood([&] {
    const auto bus = open_bus();
    Outbox<odometry_t> outbox(bus.get(), "ODOMETRY");
    odometry_t m{};
    while (flooding) outbox.publish(&m);
  });
  int reached = 0;
  for (int i = 0; i < 20; ++i) {
    const Stamp until = timeline_.now() + ms(5);
    while (timeline_.advance(until) == Timeline::Step::kDelivered) {
    }
    ++reached;
  }
  flooding = false;
  flood.join();
  EXPECT_EQ(reached, 20);
  EXPECT_GT(inbox.account().received, 0);
}

/// Sends n requests, each after the reply to the last, then stops the timelines of the process.
class Asker final : public Node {
 public:
  Asker(Bus* bus, int n) : requests_(n), in_(bus, "ANSWER", 8), out_(bus, "ODOMETRY") {}
  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override {
    return asked_ == answered_ ? Stamp::min() : in_.oldest_arrival();
  }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {&in_}; }
  void run(const Cycle& cycle) override {
    while (in_.front() != nullptr) {
      in_.pop();
      ++answered_;
    }
    if (answered_ == requests_) (void)kill(getpid(), SIGTERM);
    odometry_t m = odometry(0, to_utime(cycle.now));
    out_.publish(&m);
    ++asked_;
    cycle.stages->close_account();
  }
  [[nodiscard]] int answered() const { return answered_; }

 private:
  NodeInfo info_{"asker", ms(100), ms(1)};
  int requests_;
  int asked_ = 0;
  int answered_ = 0;
  Inbox<odometry_t> in_;
  Outbox<odometry_t> out_;
};

TEST_F(LiveTimelineTest, TwoThreadsExchangeMessagesThroughTheirExecutors) {
  Asker asker(bus_.get(), 200);
  std::atomic<std::size_t> echoed{0};
  std::atomic<bool> listening{false};
  std::thread other([&] {
    const auto bus = open_bus();
    Echo echo({"echo", ms(100), ms(1)}, bus.get(), "ODOMETRY", "ANSWER");
    LiveTimeline timeline(bus.get(), &stop_);
    listening = true;
    run({&echo}, timeline, nullptr);
    echoed = echo.seen.size();
  });
  while (!listening) std::this_thread::yield();
  const RunReport report = run({&asker}, timeline_, nullptr);
  other.join();
  EXPECT_GE(asker.answered(), 200);
  EXPECT_GE(echoed, 200U);
  EXPECT_EQ(report.nodes[0].inputs[0].account.gaps, 0);
}

}  // namespace
}  // namespace rcs
