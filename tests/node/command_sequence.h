#pragma once
// A superior, a subordinate and a network that loses, repeats and delays, for tests of the command
// protocol.

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rcs/node/command_port.h"
#include "rcs/node/stop_latch.h"

namespace rcs::test {

inline constexpr char kCommand[] = "BG_COMMAND";
inline constexpr char kStopChannel[] = "BG_STOP";
inline constexpr char kStatus[] = "BG_STATUS";
inline constexpr Duration kStep = from_milliseconds(50.0);

/// A network that loses, repeats, delays and so reorders; nothing on it is ever changed.
class Network {
 public:
  struct Flaws {
    double loss = 0.0;
    double repeat = 0.0;
    int delay_steps = 0;  // at most
  };

  explicit Network(unsigned seed) : random_(seed) {}

  Flaws flaws;

  void send(std::string_view channel, const std::uint8_t* data, std::size_t size, Stamp now) {
    for (int copies = chance(flaws.repeat) ? 2 : 1; copies > 0; --copies) {
      if (chance(flaws.loss)) continue;
      const int delay = flaws.delay_steps > 0 ? below(flaws.delay_steps + 1) : 0;
      packets_.push_back({now + delay * kStep, std::string(channel), {data, data + size}});
    }
  }
  template <class Deliver>
  void deliver(Stamp now, const Deliver& to) {
    const auto due = std::stable_partition(packets_.begin(), packets_.end(),
                                           [now](const Packet& p) { return p.due > now; });
    const std::vector<Packet> arrived(std::make_move_iterator(due),
                                      std::make_move_iterator(packets_.end()));
    packets_.erase(due, packets_.end());
    for (const Packet& p : arrived) to(p.channel, p.data);
  }
  bool chance(double p) { return p > 0.0 && std::uniform_real_distribution<>(0, 1)(random_) < p; }
  int below(int n) { return std::uniform_int_distribution<>(0, n - 1)(random_); }

 private:
  struct Packet {
    Stamp due;
    std::string channel;
    std::vector<std::uint8_t> data;
  };
  std::mt19937 random_;
  std::vector<Packet> packets_;
};

/// The network port of one process: it is destroyed with the process.
class Door final : public Bus {
 public:
  Door(Network* network, const Stamp* now) : network_(network), now_(now) {}
  void subscribe(std::string_view channel, Receiver* receiver) override {
    receivers_.emplace_back(channel, receiver);
  }
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override {
    network_->send(channel, data, size, *now_);
  }
  void receive(const std::string& channel, const std::vector<std::uint8_t>& data) {
    for (const auto& [name, receiver] : receivers_) {
      if (name == channel) receiver->receive(data.data(), data.size(), *now_);
    }
  }

 private:
  Network* network_;
  const Stamp* now_;
  std::vector<std::pair<std::string, Receiver*>> receivers_;
};

using Work = std::pair<std::string, std::int64_t>;  // issuer and serial

/// The true events, over all runs of the processes.
struct Truth {
  std::set<Work> acted_on;
  std::set<Work> done;
  bool moving = false;
};

struct Superior {
  Superior(Network* network, const Stamp* now, const char* name)
      : door(network, now), issuer(name), port(&door, kCommand, kStopChannel, kStatus, name, {}) {}
  Door door;
  std::string issuer;
  CommandPort port;
  std::int64_t serial = 0;  // newest sent
};

/// A subordinate whose work lasts some cycles.
struct Worker {
  Worker(Network* network, const Stamp* now)
      : door(network, now), subordinate(&door, "bg", kCommand, kStopChannel, kStatus, {}) {}

  void take(Stamp now) {
    subordinate.take(now);
    for (const stop_t& s : subordinate.stops()) latch.engage(s);
  }
  void report(Stamp now, StatusReport report) {
    report.stops = &latch.stops();
    report.emergency_stop = !latch.engaged() ? status_t::STOP_NONE
                            : persisted      ? status_t::STOP_PERSISTED
                                             : status_t::STOP_LATCHED;
    subordinate.report(now, report);
  }
  void release(const std::vector<std::int64_t>& ids) {
    (void)latch.release(ids, "", true, Stamp::max());
    (void)latch.step(Stamp());
    subordinate.release_stops(latch.take_released());
  }
  void release_all() {
    std::vector<std::int64_t> ids;
    for (const stop_t& s : latch.stops()) ids.push_back(s.id);
    release(ids);
  }

  void cycle(Stamp now, Network* random, Truth* truth) {
    take(now);
    const command_t* const command = subordinate.command();
    truth->moving = false;
    std::int8_t status = status_t::STATUS_UNINITIALIZED;
    if (subordinate.is_new()) {
      ASSERT_TRUE(truth->acted_on.insert({command->issuer, command->serial}).second)
          << "executed twice";
      ASSERT_LT(now, from_utime(command->valid_until_utime)) << "executed too late";
      left = random->below(8);
      failed = random->chance(0.1);
    }
    if (command != nullptr) {
      if (failed) {
        status = status_t::STATUS_ERROR;
      } else if (left <= 0) {
        status = status_t::STATUS_DONE;
        truth->done.insert({command->issuer, command->serial});
      } else if (subordinate.valid(now)) {
        status = status_t::STATUS_EXEC;
        truth->moving = true;
        --left;
      } else {
        failed = true;
        status = status_t::STATUS_ERROR;
      }
    }
    report(now, {status, "WORK", __LINE__, "", 0, 0});
  }

  Door door;
  Subordinate subordinate;
  StopLatch latch;
  bool persisted = true;  // as the status reports it
  int left = 0;
  bool failed = false;
};

/// One random sequence of two superiors, a subordinate and a lossy network; checks the invariants.
void run_sequence(unsigned seed, int steps);

}  // namespace rcs::test
