#pragma once
// Decides when to start, end and kill the node processes of `rcs up`. Pure: events with times are
// the input, actions are the output.

#include <cstddef>
#include <optional>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::cli {

struct SupervisorParams {
  Duration first_backoff = from_seconds(0.2);  ///< before a restart; doubles with each, > 0
  Duration longest_backoff = from_seconds(10.0);
  Duration healthy_after = from_seconds(30.0);  ///< uptime that resets the count of failures
  Duration start_within = from_seconds(15.0);   ///< from the start to the first heartbeat
  Duration silent_for = from_seconds(5.0);      ///< without a heartbeat: the node hangs
  Duration stop_within = from_seconds(3.0);     ///< from SIGTERM to SIGKILL
  /// Consecutive ends, each before healthy_after of uptime: the node is failing.
  int failing_after = 3;
};

/// How a process ended.
struct Exit {
  bool by_signal = false;
  int code = 0;  ///< exit status or signal number
};

/// An action on the process of one node. The supervisor assumes that it is executed.
struct SupervisorAction {
  enum class Kind { kStart, kTerminate, kKillSilent, kKillUnstarted, kKillUnstopped };
  Kind kind;
  std::size_t node;
};

class Supervisor {
 public:
  /// @param critical  for each node: true if no node may start without it
  Supervisor(const std::vector<bool>& critical, const SupervisorParams& params);

  /// Heartbeat: process_t of the process that was started last.
  void on_alive(std::size_t node, Stamp now);
  /// @return time until the restart; nullopt: no restart
  std::optional<Duration> on_exit(std::size_t node, const Exit& exit, Stamp now);
  /// Ends all processes; none is started any more.
  void stop() { stopping_ = true; }

  /// The actions due at `now`, in the order of the nodes.
  [[nodiscard]] std::vector<SupervisorAction> due(Stamp now);
  /// Time of the next action of due() if no event occurs before; Stamp::max(): never.
  [[nodiscard]] Stamp next() const;

  [[nodiscard]] bool stopping() const { return stopping_; }
  /// Stopped, and every process has ended.
  [[nodiscard]] bool finished() const;
  /// True while the node ends repeatedly. The other nodes keep running: they stop the vehicle if
  /// they require the node, and report the reason.
  [[nodiscard]] bool failing(std::size_t node) const;
  /// The critical node that was never alive and does not start, for which all were stopped.
  [[nodiscard]] std::optional<std::size_t> gave_up_on() const { return gave_up_on_; }

 private:
  enum class State { kWaiting, kStarting, kRunning, kStopping, kKilled, kEnded };
  struct NodeState {
    bool critical = true;
    State state = State::kWaiting;
    Stamp until = Stamp::min();  ///< end of waiting, or deadline of the state
    Stamp alive_since;           ///< of this process; kRunning and later
    bool was_alive = false;      ///< this process
    bool was_ever_alive = false;
    int failures = 0;  ///< consecutive
    int refusals = 0;  ///< consecutive ends with an error before the first heartbeat
  };

  void forget_failures_of_healthy(NodeState* node, Stamp now) const;
  [[nodiscard]] Duration backoff(const NodeState& node) const;

  SupervisorParams params_;
  std::vector<NodeState> nodes_;
  std::optional<std::size_t> gave_up_on_;
  bool stopping_ = false;
};

}  // namespace rcs::cli
