#pragma once
// Time and transport are one seam: what time it is, and which message arrives when.

#include "rcs/base/stamp.h"

namespace rcs {

class Timeline {
 public:
  Timeline() = default;
  Timeline(const Timeline&) = delete;
  Timeline& operator=(const Timeline&) = delete;
  virtual ~Timeline() = default;

  [[nodiscard]] virtual Stamp now() const = 0;

  /// Delivers at most one message due by `until` to its receivers, else moves to `until`.
  /// `until` may be Stamp::max(): wait for the next message.
  /// @return false at the end (log exhausted, simulation over, stop requested)
  virtual bool advance(Stamp until) = 0;

  /// Around each Node::run. Lockstep timelines hold back what the node publishes for
  /// `nominal_compute`, so that a replay has the latencies that the vehicle has.
  virtual void begin_cycle(Duration nominal_compute) = 0;
  /// @return until when the node counts as busy (live: now)
  virtual Stamp end_cycle() = 0;
};

}  // namespace rcs
