#pragma once
// SP, WM and BG on one bus with valid sensor data, and among their messages those of a test or a
// fuzzer.

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

/// Drives for a second through a walled lane. When all nodes run, the packets arrive on `channel`,
/// 20 ms apart. Aborts the process when a node publishes values that are not finite or beyond the
/// vehicle's limits, when its time runs backward, and when it does not continue with the valid
/// messages after the last packet.
/// @param listener  receives all messages except the packets; null: none
void hostile_drive(std::string_view channel, const std::vector<Bytes>& packets, BusTap* listener);

}  // namespace rcs::test
