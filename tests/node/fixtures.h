#pragma once
// Small nodes and event sources shared by the tests of rcs/node.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/odometry_t.hpp"
#include "rcs/node/budget.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/node.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs::test {

constexpr Stamp at_ms(std::int64_t ms) { return from_utime(ms * 1000); }
constexpr Duration ms(std::int64_t n) { return Duration(n * 1000); }

template <class T>
std::vector<std::uint8_t> encode(const T& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, message.getEncodedSize());
  return bytes;
}

inline odometry_t odometry(std::int64_t seq, std::int64_t utime) {
  odometry_t m{};
  m.utime = utime;
  m.seq = seq;
  m.speed_mps = 0.001 * static_cast<double>(seq);
  return m;
}

/// Events given in advance.
class ListSource final : public EventSource {
 public:
  struct Item {
    Stamp due;
    std::string channel;
    std::vector<std::uint8_t> data;
  };
  explicit ListSource(std::vector<Item> items) : items_(std::move(items)) {}

  [[nodiscard]] Stamp peek() override {
    return next_ < items_.size() ? items_[next_].due : Stamp::max();
  }
  void take(SourceEvent* event) override {
    event->channel = items_[next_].channel;
    event->data = items_[next_].data;
    ++next_;
  }

 private:
  std::vector<Item> items_;
  std::size_t next_ = 0;
};

/// Odometry every `period`, from `first` on, n times.
inline std::vector<ListSource::Item> odometry_items(Stamp first, Duration period, int n) {
  std::vector<ListSource::Item> items;
  for (int i = 0; i < n; ++i) {
    const Stamp due = first + i * period;
    items.push_back({due, "ODOMETRY", encode(odometry(i + 1, to_utime(due)))});
  }
  return items;
}

/// Publishes a message on one channel for each message received on another.
class Echo final : public Node {
 public:
  struct Seen {
    std::int64_t seq;
    Stamp arrival;
    Cycle cycle;
  };
  Echo(NodeInfo info, Bus* bus, const std::string& in, const std::string& out,
       std::size_t depth = 8)
      : info_(std::move(info)), in_(bus, in, depth), out_(bus, out) {
    seen.reserve(100'000);
  }

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return in_.oldest_arrival(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {&in_}; }
  void run(const Cycle& cycle) override {
    while (const odometry_t* m = in_.front()) {
      seen.push_back({m->seq, in_.front_arrival(), cycle});
      answer_ = *m;
      in_.pop();
      out_.publish(&answer_);
    }
    cycle.stages->mark("echo");
    cycle.stages->close_account();
  }

  std::vector<Seen> seen;

 private:
  NodeInfo info_;
  Inbox<odometry_t> in_;
  Outbox<odometry_t> out_;
  odometry_t answer_{};
};

}  // namespace rcs::test
