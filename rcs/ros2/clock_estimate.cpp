#include "rcs/ros2/clock_estimate.h"

#include <algorithm>
#include <cstdlib>

#include "lcmtypes/channels.h"
#include "lcmtypes/plausible.h"

namespace rcs::ros2 {
namespace {

bool ends_in(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

}  // namespace

ChannelClock clock_of(std::string_view channel) {
  if (channel::is_sensor(channel)) return ChannelClock::kSensor;
  for (const char* end : {"_EVENT", "_CYCLE", "_PROCESS"}) {
    if (ends_in(channel, end)) return ChannelClock::kNode;
  }
  return channel == channel::kBgStatus || channel == channel::kBgDrive ? ChannelClock::kNode
                                                                       : ChannelClock::kOther;
}

void ClockEstimate::add(std::string_view channel, std::int64_t utime, Stamp stamp) {
  if (!plausible_stamp(utime) || !plausible_stamp(to_utime(stamp))) return;
  switch (clock_of(channel)) {
    case ChannelClock::kSensor:
      sensor_.add(utime, stamp);
      break;
    case ChannelClock::kNode:
      node_.add(utime, stamp);
      break;
    case ChannelClock::kOther:
      break;
  }
}

void ClockEstimate::Clock::add(std::int64_t utime, Stamp stamp) {
  if (closed) return;
  const std::int64_t difference_us = to_utime(stamp) - utime;
  if (!first) {
    first = stamp;
    min_us = difference_us;
  }
  closed = stamp - *first > kWindow;
  if (!closed) min_us = std::min(min_us, difference_us);
}

std::int64_t ClockEstimate::Clock::offset_us() const {
  return std::abs(min_us) < kSame.count() ? 0 : min_us;
}

ros2::ClockOffsets ClockEstimate::offsets() const {
  return {sensor_.offset_us(), node_.offset_us()};
}

}  // namespace rcs::ros2
