#include "tools/view/source/live_clocks.h"

namespace rcs::view {

bool LiveClocks::fits(std::string_view channel, std::int64_t utime, Stamp received) const {
  const ros2::ClockOffsets offsets = estimate_.offsets();
  const std::int64_t offset_us =
      ros2::clock_of(channel) == ros2::ChannelClock::kSensor ? offsets.sensor_us : offsets.node_us;
  const Duration late = received - from_utime(ros2::shifted(utime, offset_us));
  return late < ros2::ClockEstimate::kSame && late > -ros2::ClockEstimate::kSame;
}

bool LiveClocks::add(std::string_view channel, std::int64_t utime, Stamp received, Stamp now) {
  if (!known_) {
    if (!begin_) begin_ = now;
    estimate_.add(channel, utime, received);
    known_ = now - *begin_ > kWindow;
    return known_;
  }
  const ros2::ChannelClock clock = ros2::clock_of(channel);
  if (clock == ros2::ChannelClock::kOther) return false;
  // A late message shows no other clock, and neither does one sensor whose clock is wrong.
  std::optional<Stamp>& differs_from =
      clock == ros2::ChannelClock::kSensor ? sensors_differ_from_ : nodes_differ_from_;
  if (fits(channel, utime, received)) {
    differs_from.reset();
  } else if (!differs_from) {
    differs_from = now;
  } else if (now - *differs_from > kWindow) {
    *this = {};
  }
  return false;
}

}  // namespace rcs::view
