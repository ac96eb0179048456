#pragma once
// Runs nodes on a timeline: the node with the earliest obligation first, ties by list order. The
// vehicle, a replay and the simulator use the same executor.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/node/budget.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/node.h"
#include "rcs/node/timeline/timeline.h"

namespace rcs {

/// The account of one unit of work, in the cycle that closed it.
struct CycleAccount {
  const Cycle* cycle = nullptr;  ///< cycle->stages has the stopwatch values
  Duration late{};               ///< start - wakeup
  Duration slack{};              ///< deadline - end; negative: an overrun
  std::int64_t missed = 0;       ///< periods skipped so far to keep the phase
  std::int64_t overruns = 0;     ///< cycles so far that ended after their deadline
  const std::vector<const InboxBase*>* inputs = nullptr;
  int degrade_level = 0;  ///< Node::degrade_level() after the cycle
};

/// Destination of accounts: live <NAME>_CYCLE, in a replay a timing file. Stopwatch values must
/// never enter a replay's output log.
class CycleSink {
 public:
  virtual void on_account(const NodeInfo& node, const CycleAccount& account) = 0;

 protected:
  ~CycleSink() = default;
};

struct NodeReport {
  std::string name;
  std::int64_t cycles = 0;
  std::int64_t missed = 0;
  std::int64_t overruns = 0;
  Duration worst_late{};
  Duration worst_wall{};  ///< of one cycle
  struct Input {
    std::string channel;
    InboxBase::Account account;
  };
  std::vector<Input> inputs;
};

struct RunReport {
  std::vector<NodeReport> nodes;

  /// A table for the terminal.
  [[nodiscard]] std::string text() const;
};

/// Runs until the timeline ends. All messages due by a cycle's start are delivered before it (live:
/// as many as the timeline's fairness allows). A node that overruns keeps its phase; its missed
/// cycles are counted and not made up for. No allocation after the first cycles.
/// @param sink  may be null
RunReport run(const std::vector<Node*>& nodes, Timeline& timeline, CycleSink* sink);

}  // namespace rcs
