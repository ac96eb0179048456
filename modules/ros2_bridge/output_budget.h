#pragma once
// How much is published to ROS 2: the rate of a topic, and the bytes a second of all topics.

#include <array>
#include <cstddef>
#include <cstdint>

#include "rcs/base/stamp.h"

namespace rcs::ros2_bridge {

/// Limits the rate of one topic.
class Decimator {
 public:
  /// @param period  zero: every message is published
  explicit Decimator(Duration period) : period_(period) {}

  /// The mean rate of the admitted messages approaches 1 / period if enough messages arrive,
  /// because the grid of periods is kept; after a silence of a period or more it begins again.
  [[nodiscard]] bool admit(Stamp now);

 private:
  Duration period_;
  Stamp next_ = Stamp::min();
};

/// Limits the bytes that are published in any second.
class ByteBudget {
 public:
  enum class Verdict {
    kGranted,
    kExhausted,  ///< not now; a later message of the size may be granted
    kTooLarge,   ///< never
  };
  /// Messages up to this size (poses, transforms) may use the whole budget, larger ones four
  /// fifths, so that clouds do not displace poses.
  static constexpr std::size_t kSmallBytes = 4096;

  explicit ByteBudget(std::size_t max_bytes_per_s) : max_bytes_(max_bytes_per_s) {}

  /// Law: the bytes granted within any interval of one second are at most max_bytes_per_s.
  /// @param now  not before the last call
  [[nodiscard]] Verdict take(std::size_t bytes, Stamp now);

 private:
  // The sum of the current slot and of those before it covers a second and up to a tenth more.
  static constexpr std::size_t kSlots = 11;
  static constexpr Duration kSlot = std::chrono::milliseconds(100);

  std::size_t max_bytes_;
  std::array<std::size_t, kSlots> granted_{};
  std::size_t sum_ = 0;
  std::int64_t slot_ = 0;  // number of the current slot
};

}  // namespace rcs::ros2_bridge
