#pragma once
// Encodes messages of one type onto one channel; owns the sequence number and the publisher's ids.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/check.h"
#include "rcs/node/bus/bus.h"

namespace rcs {

template <class T>
class Outbox {
 public:
  Outbox(Bus* bus, std::string_view channel)
      : bus_(bus),
        channel_(channel),
        publisher_(bus->publisher()),
        seq_(bus->sequence_of(channel)) {}

  /// Allocates room for messages of `bytes` bytes in advance.
  void reserve(std::size_t bytes) { buffer_.resize(std::max(buffer_.size(), bytes)); }

  /// Sets message->seq (1, 2, ...), run_id and publisher_id, and publishes. No allocation if the
  /// buffer is large enough.
  void publish(T* message) {
    message->seq = ++*seq_;
    message->run_id = publisher_.run_id;
    message->publisher_id = publisher_.publisher_id;
    const int size = message->getEncodedSize();
    if (buffer_.size() < static_cast<std::size_t>(size)) {
      buffer_.resize(static_cast<std::size_t>(size));
    }
    RCS_CHECK(message->encode(buffer_.data(), 0, size) == size);
    bus_->publish(channel_, buffer_.data(), static_cast<std::size_t>(size));
  }

 private:
  Bus* bus_;
  std::string channel_;
  Publisher publisher_;
  std::vector<std::uint8_t> buffer_;
  std::int64_t* seq_;
};

}  // namespace rcs
