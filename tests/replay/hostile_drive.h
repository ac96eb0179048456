#pragma once
// SP, WM and BG on one bus with good sensors, and among their messages whatever a test or a fuzzer
// sends.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/local_bus.h"

namespace rcs::test {

using Bytes = std::vector<std::uint8_t>;

template <class T>
Bytes encode(const T& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, message.getEncodedSize());
  return bytes;
}

/// The vehicle's configuration.
[[nodiscard]] const char* hostile_drive_config();

/// Drives for a second through a walled lane. When all nodes are at work the packets come in on
/// `channel`, 20 ms apart. Stops the process when a node says what is not finite or beyond the
/// vehicle's limits, when its time runs backward, and when it does not go on with the good messages
/// after the last packet.
/// @param listener  hears all but the packets; null: nobody does
void hostile_drive(std::string_view channel, const std::vector<Bytes>& packets, BusTap* listener);

}  // namespace rcs::test
