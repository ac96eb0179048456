#pragma once
// When to start, end and kill the node processes of `rcs up`. Pure: what happened goes in with its
// time, what is to be done comes out.

#include <cstddef>
#include <optional>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::cli {

struct SupervisorParams {
  Duration first_backoff = from_seconds(0.2);  ///< before a restart; doubles with each, > 0
  Duration longest_backoff = from_seconds(10.0);
  Duration healthy_after = from_seconds(30.0);  ///< of life: then the next death is a first one
  Duration start_within = from_seconds(15.0);   ///< from the start to the first sign of life
  Duration silent_for = from_seconds(5.0);      ///< without a sign of life: it hangs
  Duration stop_within = from_seconds(3.0);     ///< from SIGTERM to SIGKILL
  /// Deaths in a row without healthy_after of life between them: the node is failing.
  int failing_after = 3;
};

/// How a process ended.
struct Exit {
  bool by_signal = false;
  int code = 0;  ///< exit status, or the signal
};

/// What is to be done with one node's process. It counts as done.
struct Order {
  enum class Kind { kStart, kTerminate, kKillSilent, kKillUnstarted, kKillUnstopped };
  Kind kind;
  std::size_t node;
};

class Supervisor {
 public:
  /// @param critical  of each node: without it nothing is to start
  Supervisor(const std::vector<bool>& critical, const SupervisorParams& params);

  /// A sign of life: process_t of the process that was started last.
  void on_alive(std::size_t node, Stamp now);
  /// @return after what time it will be started again; none: it will not
  std::optional<Duration> on_exit(std::size_t node, const Exit& exit, Stamp now);
  /// Ends all of them; nothing is started any more.
  void stop() { stopping_ = true; }

  /// What is to be done by now, nodes in their order.
  [[nodiscard]] std::vector<Order> due(Stamp now);
  /// When due() has something to say next, if nothing happens before; Stamp::max(): never.
  [[nodiscard]] Stamp next() const;

  [[nodiscard]] bool stopping() const { return stopping_; }
  /// Stopped, and every process has ended.
  [[nodiscard]] bool finished() const;
  /// True while it dies again and again. The others run on: they stop the vehicle if they miss it,
  /// and report why.
  [[nodiscard]] bool failing(std::size_t node) const;
  /// The critical node that was never alive and refuses to start, for which all were stopped.
  [[nodiscard]] std::optional<std::size_t> gave_up_on() const { return gave_up_on_; }

 private:
  enum class State { kWaiting, kStarting, kRunning, kStopping, kKilled, kEnded };
  struct NodeState {
    bool critical = true;
    State state = State::kWaiting;
    Stamp until = Stamp::min();  ///< what the state waits for, or its deadline
    Stamp alive_since;           ///< of this life; kRunning and later
    bool was_alive = false;      ///< in this life
    bool was_ever_alive = false;
    int failures = 0;  ///< in a row
    int refusals = 0;  ///< in a row: ends with an error before the first sign of life
  };

  void forget_failures_of_healthy(NodeState* node, Stamp now) const;
  [[nodiscard]] Duration backoff(const NodeState& node) const;

  SupervisorParams params_;
  std::vector<NodeState> nodes_;
  std::optional<std::size_t> gave_up_on_;
  bool stopping_ = false;
};

}  // namespace rcs::cli
