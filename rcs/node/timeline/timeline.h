#pragma once
// One interface for time and transport: the current time, and which message arrives when.

#include "rcs/base/stamp.h"

namespace rcs {

class Timeline {
 public:
  enum class Step {
    kDelivered,  ///< one message, due by `until`; there may be more
    kReached,    ///< nothing (more) is due: the time is `until`
    kEnded,      ///< log exhausted, simulation over, stop requested
  };

  Timeline() = default;
  Timeline(const Timeline&) = delete;
  Timeline& operator=(const Timeline&) = delete;
  virtual ~Timeline() = default;

  [[nodiscard]] virtual Stamp now() const = 0;

  /// Delivers at most one message due by `until` to its receivers, else moves to `until`, which may
  /// lie in the past (deliver what waits) or be Stamp::max() (wait for the next message).
  virtual Step advance(Stamp until) = 0;

  /// Called around each Node::run. Lockstep timelines delay what the node publishes by
  /// `nominal_compute`, so that a replay has the latencies of the vehicle.
  virtual void begin_cycle(Duration nominal_compute) = 0;
  /// @return the moment until which the node is busy (live: now)
  virtual Stamp end_cycle() = 0;
};

}  // namespace rcs
