#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"

namespace rcs {

/// Passes on every decodable message of a channel with its arrival.
template <class T>
class Tap final : public Receiver {
 public:
  using Take = std::function<void(const T&, Stamp arrival)>;
  Tap(Bus* bus, std::string_view channel, Take take) : take_(std::move(take)) {
    bus->subscribe(channel, this);
  }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;
  ~Tap() = default;

  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
    if (message_.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) return;
    take_(message_, arrival);
  }

 private:
  Take take_;
  T message_{};
};

}  // namespace rcs
