#pragma once
// Receives a channel for a function: for programs and tests around the nodes, which have inboxes.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>
#include <string_view>
#include <utility>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/message_size.h"

namespace rcs {

/// Passes on every decodable message of a channel with its arrival. It must live as long as
/// messages are delivered.
template <class T>
class Tap final : public Receiver {
 public:
  using Take = std::function<void(const T&, Stamp arrival)>;
  /// @param malformed  called instead for a message that is not of the type, or larger than
  ///                   kMaxEncodedBytes; may be empty
  Tap(Bus* bus, std::string_view channel, Take take, std::function<void()> malformed = {})
      : take_(std::move(take)), malformed_(std::move(malformed)) {
    bus->subscribe(channel, this);
  }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;
  ~Tap() = default;

  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
    if (size <= kMaxEncodedBytes<T> && decodes(data, static_cast<int>(size))) {
      take_(message_, arrival);
    } else if (malformed_) {
      malformed_();
    }
  }

 private:
  [[nodiscard]] bool decodes(const std::uint8_t* data, int size) {
    try {
      return message_.decode(data, 0, size) == size;
    } catch (const std::bad_alloc&) {
      return false;  // a length that no message has
    }
  }

  Take take_;
  std::function<void()> malformed_;
  T message_{};
};

}  // namespace rcs
