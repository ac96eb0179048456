#pragma once
// The end of the validity of the vehicle's identity: when it is reported.

#include <chrono>
#include <cstdint>

#include "rcs/base/stamp.h"

namespace rcs::gateway {

class IdentityWatch {
 public:
  enum class State {
    kValid,
    kEndsSoon,  ///< within kSoon
    kExpired    ///< DDS has closed the connection
  };
  static constexpr Duration kSoon = std::chrono::hours(24 * 30);
  static constexpr Duration kRepeat = std::chrono::hours(24);

  /// @param end_utime  UTC, in microseconds since 1970
  explicit IdentityWatch(std::int64_t end_utime) : end_utime_(end_utime) {}

  /// By the wall clock, which may be set in both directions.
  [[nodiscard]] State state(std::int64_t wall_utime) const;
  /// Whole days before the end.
  [[nodiscard]] int days_left(std::int64_t wall_utime) const;

  /// Whether the state is to be reported: it has become worse, or was reported kRepeat ago. True
  /// once, because it then counts as reported. Never for kValid.
  /// @param now  node time
  [[nodiscard]] bool take_due(std::int64_t wall_utime, Stamp now);

 private:
  std::int64_t end_utime_;
  State reported_ = State::kValid;
  Stamp reported_at_ = Stamp::min();
};

}  // namespace rcs::gateway
