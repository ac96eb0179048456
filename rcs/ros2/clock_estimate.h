#pragma once
// The offsets of the two clocks of a log against the stamps of its events.

#include <cstdint>
#include <optional>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/ros2/frames.h"

namespace rcs::ros2 {

/// The smallest difference between the stamp of an event and the time in its message, over the
/// first kWindow of each clock: the message with the least delay. A clock that agrees with the
/// stamps within kSame is that of the stamps: its offset is 0, and times remain as they are.
class ClockEstimate {
 public:
  static constexpr Duration kWindow = std::chrono::seconds(10);
  static constexpr Duration kSame = std::chrono::seconds(1);

  /// @param utime  of the message (its first field)
  void add(std::string_view channel, std::int64_t utime, Stamp stamp);
  /// True when both clocks are known: further events change nothing.
  [[nodiscard]] bool complete() const { return sensor_.closed && node_.closed; }
  /// A message of a sensor has been added.
  [[nodiscard]] bool knows_sensors() const { return sensor_.first.has_value(); }
  /// 0 for a clock without messages.
  [[nodiscard]] ros2::ClockOffsets offsets() const;

 private:
  struct Clock {
    std::optional<Stamp> first;
    std::int64_t min_us = 0;
    bool closed = false;

    void add(std::int64_t utime, Stamp stamp);
    [[nodiscard]] std::int64_t offset_us() const;
  };

  Clock sensor_;
  Clock node_;
};

/// Whether the utime of a channel is node time; else it is sensor time, or that of an operator.
enum class ChannelClock { kSensor, kNode, kOther };
[[nodiscard]] ChannelClock clock_of(std::string_view channel);

}  // namespace rcs::ros2
