#pragma once
// What an RCS function is to the executor.

#include <cstdint>
#include <string>
#include <vector>

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
  std::string name;          ///< "sp": also the prefix of its channels, in capitals
  Duration budget{};         ///< from wakeup to the end of the cycle
  Duration nominal_compute{};  ///< a replay delays the node's output by this
};

/// One RCS function (SP, WM, BG, ...). It never blocks, sleeps or reads a clock, so it cannot tell
/// whether it runs live, in a replay or in a simulation.
class Node {
 public:
  Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual ~Node() = default;

  [[nodiscard]] virtual const NodeInfo& info() const = 0;

  /// Periodic: last + period. Event-driven: the arrival of the oldest message that waits, and
  /// Stamp::max() when none does.
  [[nodiscard]] virtual Stamp next_wakeup() const = 0;

  /// Reads inboxes, decides with pure functions, writes outboxes.
  virtual void run(const Cycle& cycle) = 0;

  /// For the account of inputs in cycle_t.
  [[nodiscard]] virtual std::vector<const InboxBase*> inboxes() const = 0;
};

}  // namespace rcs
