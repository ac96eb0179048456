#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/node/bus.h"

namespace rcs::test {

/// Decodes every message of a channel and hands it on.
template <class T>
class Tap final : public Receiver {
 public:
  Tap(Bus* bus, std::string_view channel, std::function<void(const T&)> take)
      : take_(std::move(take)) {
    bus->subscribe(channel, this);
  }
  void receive(const std::uint8_t* data, std::size_t size, Stamp /*arrival*/) noexcept override {
    RCS_CHECK(message_.decode(data, 0, static_cast<int>(size)) == static_cast<int>(size));
    take_(message_);
  }

 private:
  std::function<void(const T&)> take_;
  T message_{};
};

}  // namespace rcs::test
