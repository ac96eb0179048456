#pragma once
// The clocks of a bus: estimated when the viewer starts, and again when they turn out to be others.

#include <cstdint>
#include <optional>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/ros2/clock_estimate.h"

namespace rcs::view {

/// A sensor that publishes for the first time, a simulation that begins again and a vehicle that
/// boots all have clocks that the first messages did not show.
class LiveClocks {
 public:
  /// The clocks are estimated from the messages of this time.
  static constexpr Duration kWindow = std::chrono::milliseconds(500);

  /// @param utime     of the message (its first field)
  /// @param received  wall clock
  /// @param now       not before that of the last call
  /// @return  the clocks became known: what is passed from now on has other times than before
  bool add(std::string_view channel, std::int64_t utime, Stamp received, Stamp now);
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] ros2::ClockOffsets offsets() const { return estimate_.offsets(); }

 private:
  /// The time of a message is as the estimate predicts.
  [[nodiscard]] bool fits(std::string_view channel, std::int64_t utime, Stamp received) const;

  ros2::ClockEstimate estimate_;
  std::optional<Stamp> begin_;                // of the estimate
  std::optional<Stamp> sensors_differ_from_;  // since when no message of the clock has fitted
  std::optional<Stamp> nodes_differ_from_;
  bool known_ = false;
};

}  // namespace rcs::view
