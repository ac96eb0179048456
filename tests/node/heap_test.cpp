// After warm-up rcs/node does not allocate: executor, lockstep timeline, local bus, inboxes,
// outboxes, cycle accounts, reports.

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/node/executor.h"
#include "rcs/node/process/cycle_sinks.h"
#include "rcs/node/report.h"
#include "tests/node/fixtures.h"
#include "tests/support/heap_guard.h"

namespace rcs {
namespace {

using test::at_ms;
using test::HeapGuard;
using test::ms;

constexpr event::Info kCycleEvent{
    "test", "test.cycle", event::Severity::kWarning, event::Limit::kOne, "", "", ""};

/// Receives a cloud, publishes another of varying size and sometimes an event; counts allocations
/// after `warm` cycles.
class Busy final : public Node {
 public:
  Busy(Bus* bus, const char* in, const char* out, const char* name, int warm)
      : info_{name, ms(10), ms(3)},
        in_(bus, in, 4),
        out_(bus, out),
        report_(bus, name, ms(50)),
        warm_(warm) {}

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return in_.oldest_arrival(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {&in_}; }
  void run(const Cycle& cycle) override {
    if (warm_ > 0 && static_cast<int>(cycle.index) == warm_) guard_.emplace();
    while (const points_t* m = in_.front()) {
      message_ = *m;
      in_.pop();
    }
    cycle.stages->mark("read");
    const std::size_t n = 100 + cycle.index % 7;
    message_.n = static_cast<std::int32_t>(n);
    message_.x_m.resize(n);
    message_.y_m.resize(n);
    message_.z_m.resize(n);
    out_.publish(&message_);
    report_.publish(cycle.now, kCycleEvent,
                    "cycle {} at {:.3f} s, {} points, a text longer than SSO", cycle.index, 0.1, n);
    cycle.stages->mark("write");
    cycle.stages->close_account();
    ++cycles;
    if (guard_) allocations = guard_->allocations();
  }

  int cycles = 0;
  std::int64_t allocations = -1;

 private:
  NodeInfo info_;
  Inbox<points_t> in_;
  Outbox<points_t> out_;
  Report report_;
  points_t message_{};
  int warm_;
  std::optional<HeapGuard> guard_;
};

/// The same cloud every 10 ms with a reused buffer.
class CloudSource final : public EventSource {
 public:
  CloudSource() {
    points_t cloud{};
    cloud.n = 120;
    cloud.x_m.resize(120);
    cloud.y_m.resize(120);
    cloud.z_m.resize(120);
    bytes_ = test::encode(cloud);
  }
  [[nodiscard]] Stamp peek() override { return sent_ < 500 ? at_ms(10 * sent_) : Stamp::max(); }
  void take(SourceEvent* event) override {
    event->channel = "CLOUD";
    event->data = bytes_;
    ++sent_;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::int64_t sent_ = 0;
};

TEST(HeapGuard, CountsAllocations) {
  if (!HeapGuard::available()) GTEST_SKIP() << "NOT TESTED: a sanitizer owns malloc";
  const HeapGuard guard;
  EXPECT_EQ(guard.allocations(), 0);
  void* volatile p = std::malloc(10);
  std::free(p);
  const std::unique_ptr<int> q(new int(1));
  EXPECT_EQ(guard.allocations(), 2);
}

TEST(Heap, TheFrameworkAllocatesNothingAfterWarmUp) {
  if (!HeapGuard::available()) GTEST_SKIP() << "NOT TESTED: a sanitizer owns malloc";
  LocalBus bus;
  Busy first(&bus, "CLOUD", "MIDDLE", "first", 150);
  Busy second(&bus, "MIDDLE", "END", "second", 0);
  Inbox<points_t> end(&bus, "END", 2);
  CloudSource source;
  LockstepTimeline timeline(&bus, &source, ms(100));
  CyclePublisher sink(&bus);
  run({&first, &second}, timeline, &sink);
  EXPECT_EQ(first.cycles, 500);
  EXPECT_EQ(second.cycles, 500);
  // Counted from the 150th to the last cycle of `first`, everything in between included.
  EXPECT_EQ(first.allocations, 0);
}

}  // namespace
}  // namespace rcs
