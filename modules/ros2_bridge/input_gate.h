#pragma once
// Which messages of an input from ROS 2 are accepted: of one publisher, at a limited rate, with
// plausible stamps that increase. Pure: the times are arguments.

#include <cstdint>
#include <optional>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/channel_owner.h"

namespace rcs::ros2_bridge {

struct StampLimits {
  Duration max_age = from_seconds(1.0);          ///< of a stamp before the present
  Duration max_ahead = from_milliseconds(20.0);  ///< of a stamp after the present
  Duration restart_after = from_seconds(2.0);    ///< see InputGate::judge_stamp
};

enum class InputVerdict {
  kAccepted,
  kRestarted,  ///< accepted, although the stamp is not later than the last accepted one
  kSecondPublisher,
  kTooFast,
  kStampAhead,
  kStampOld,
  kStampNotLater,
};
[[nodiscard]] std::string_view name_of(InputVerdict verdict);

class InputGate {
 public:
  /// @param max_rate_hz  mean rate; short bursts of a quarter of a second are accepted
  InputGate(double max_rate_hz, const StampLimits& limits);

  /// Before a message is decoded. A publisher owns the input as the owner of a sensor channel does
  /// (rcs/node/bus/channel_owner.h): another one is accepted only after its silence.
  /// @param publisher  handle of DDS
  /// @param now        node time, not before the last call
  /// @return kAccepted, kSecondPublisher or kTooFast
  [[nodiscard]] InputVerdict judge_arrival(std::uint64_t publisher, Stamp now);

  /// Then the stamp, and only of messages that are otherwise valid. Stamps that are not later than
  /// the last accepted one are rejected until they have increased for restart_after: then the
  /// source has been restarted.
  /// @param stamp_us, present_us  UTC since 1970
  [[nodiscard]] InputVerdict judge_stamp(std::uint64_t publisher, std::int64_t stamp_us,
                                         std::int64_t present_us, Stamp now);

 private:
  StampLimits limits_;
  double rate_hz_;
  double max_tokens_;
  double tokens_;  // messages that may arrive now
  Stamp refilled_ = Stamp::min();
  ChannelOwner owner_{ChannelOwner::Rule::kOne, 0};
  std::optional<std::int64_t> last_us_;  // newest accepted stamp
  std::optional<Stamp> back_since_;      // node time
  std::int64_t back_us_ = 0;             // newest stamp since then
};

/// UTC as an offset to node time. Both clocks are slewed alike by NTP, so that their difference
/// changes by steps only; readings of it are too large by the time between two system calls.
class UtcOffset {
 public:
  static constexpr Duration kStep = std::chrono::milliseconds(5);  ///< smaller changes are adopted
  static constexpr int kWindow = 50;  ///< readings after which a step forward is certain

  /// @param utc_us  read just after `now`
  /// @return the step of UTC that this reading has revealed; zero: none
  Duration add(std::int64_t utc_us, Stamp now);
  /// UTC minus node time [us]; 0 before the first reading.
  [[nodiscard]] std::int64_t us() const { return offset_us_.value_or(0); }

 private:
  std::optional<std::int64_t> offset_us_;
  std::int64_t min_us_ = 0;  // of the current window
  int readings_ = 0;
};

}  // namespace rcs::ros2_bridge
