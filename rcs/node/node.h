#pragma once
// The interface of an RCS function to the executor.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/check.h"
#include "rcs/base/stamp.h"

namespace rcs {

class StageClock;
class InboxBase;

struct Cycle {
  std::uint64_t index = 0;
  Stamp wakeup;                  ///< when the obligation arose (period or arrival)
  Stamp now;                     ///< timeline at the start
  Stamp deadline;                ///< wakeup + budget
  StageClock* stages = nullptr;  ///< never null inside run()
};

struct NodeInfo {
  std::string name;            ///< "sp": also the prefix of its channels, in capitals
  Duration budget{};           ///< from wakeup to the end of the cycle
  Duration nominal_compute{};  ///< a replay delays the node's output by this
};

/// One RCS function (SP, WM, BG, ...). It never blocks, sleeps or reads a clock, so that it runs
/// live exactly as in a replay or a simulation.
class Node {
 public:
  Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual ~Node() = default;

  [[nodiscard]] virtual const NodeInfo& info() const = 0;

  /// Periodic: last + period (see PeriodicClock). Event-driven: the arrival of the oldest waiting
  /// message; Stamp::max() if none waits. Stamp::min(): at once.
  [[nodiscard]] virtual Stamp next_wakeup() const = 0;

  /// Reads inboxes, decides with pure functions, writes outboxes. It must discharge the obligation:
  /// afterwards next_wakeup() is later, or another message waits.
  virtual void run(const Cycle& cycle) = 0;

  /// For the account of inputs in cycle_t; called once, before the first cycle.
  [[nodiscard]] virtual std::vector<const InboxBase*> inboxes() const = 0;

  /// Of the next cycle: for nodes whose cycles differ (SP converts a facet in microseconds and
  /// registers a scan in milliseconds). Called just before run().
  [[nodiscard]] virtual Duration nominal_compute() const { return info().nominal_compute; }

  /// Whole periods skipped so far to keep the phase (PeriodicClock::missed()).
  [[nodiscard]] virtual std::int64_t missed_cycles() const { return 0; }

  /// Amount of work that the node left out in its newest unit of work, to meet its deadline; 0:
  /// none.
  [[nodiscard]] virtual int degrade_level() const { return 0; }

  /// What a person should know of the process, e.g. keys that expire soon; empty: nothing. Shown by
  /// `rcs top` until it is empty again.
  [[nodiscard]] virtual std::string_view note() const { return {}; }
};

/// The wakeups of a periodic node: first + k * period. After an overrun it continues at the next
/// grid point; the points that passed meanwhile are counted and not made up for.
class PeriodicClock {
 public:
  explicit PeriodicClock(Duration period) : period_(period) {
    RCS_CHECK(period > Duration::zero());
  }

  [[nodiscard]] Duration period() const { return period_; }
  [[nodiscard]] Stamp next() const { return next_; }  ///< Stamp::min() before the first cycle
  [[nodiscard]] std::int64_t missed() const { return missed_; }
  [[nodiscard]] bool due(Stamp now) const { return next_ <= now; }

  /// Call it in the cycle that serves the period, i.e. when due(now). The first call sets the
  /// phase.
  void advance(Stamp now) {
    RCS_CHECK(due(now));
    if (next_ == Stamp::min()) {
      next_ = now + period_;
      return;
    }
    const std::int64_t passed = (now - next_) / period_;  // grid points after the one served
    missed_ += passed;
    next_ += (passed + 1) * period_;
  }

 private:
  Duration period_;
  Stamp next_ = Stamp::min();
  std::int64_t missed_ = 0;
};

}  // namespace rcs
