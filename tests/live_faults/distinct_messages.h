#pragma once
// An endless sequence of distinct valid messages of a channel: the content of the newest one with
// other stamps and numbers, and commands of ever other issuers.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "lcmtypes/channel_types.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/bus/tap.h"

namespace rcs::live_faults {

class DistinctMessages {
 public:
  DistinctMessages() = default;
  DistinctMessages(const DistinctMessages&) = delete;
  DistinctMessages& operator=(const DistinctMessages&) = delete;
  virtual ~DistinctMessages() = default;
  /// The next message; valid until the next call.
  virtual const std::vector<std::uint8_t>& next(Stamp now) = 0;
};

template <class T>
class DistinctMessagesOf final : public DistinctMessages {
 public:
  /// @param as_owner  with the ids of the publisher of the channel, else with those of the bus
  DistinctMessagesOf(Bus* bus, std::string_view channel, bool as_owner)
      : stops_(channel == channel::kBgStop),
        as_owner_(as_owner),
        own_(bus->publisher()),
        tap_(bus, channel, [this](const T& m, Stamp at) { note(m, at); }) {}

  const std::vector<std::uint8_t>& next(Stamp now) override {
    ++number_;
    vary(&message_, to_utime(now));
    message_.seq = seq_ + number_;
    message_.run_id = as_owner_ ? run_id_ : own_.run_id;
    message_.publisher_id = as_owner_ ? publisher_id_ : own_.publisher_id;
    bytes_.resize(static_cast<std::size_t>(message_.getEncodedSize()));
    (void)message_.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
    return bytes_;
  }

 private:
  void note(const T& m, Stamp at) {
    const bool mine = m.publisher_id == own_.publisher_id || (number_ > 0 && as_owner_);
    if (mine) return;
    message_ = m;
    seq_ = m.seq - number_;
    utime_ = m.utime;
    ahead_us_ = m.utime - to_utime(at);
    run_id_ = m.run_id;
    publisher_id_ = m.publisher_id;
  }

  template <class M>
  void vary(M* m, std::int64_t now) {
    m->utime = utime_ = std::max(utime_ + 1, now + ahead_us_);
  }
  void vary(command_t* m, std::int64_t now) {
    m->issuer = fmt::format("flood{}", number_ % 1000);
    m->boot_id = own_.boot_id;
    m->utime = now;
    m->serial = now;
    m->valid_until_utime = now + 2'500'000;
    m->kind = stops_             ? command_t::KIND_EMERGENCY_STOP
              : number_ % 2 == 0 ? command_t::KIND_GOTO
                                 : command_t::KIND_HALT;
    m->stop_id.clear();
    if (stops_) m->stop_id = {id_of(m->issuer, number_) | 1};
    m->n_stops = static_cast<std::int32_t>(m->stop_id.size());
  }
  void vary(path_query_t* m, std::int64_t now) {
    m->issuer = fmt::format("flood{}", number_ % 1000);
    m->serial = number_;
    m->utime = now;
    m->x_m = {50.0 + 0.001 * static_cast<double>(number_ % 1000), 100.0};
    m->y_m = {20.0, 40.0};
    m->n = 2;
  }

  bool stops_;
  bool as_owner_;
  Publisher own_;
  T message_{};
  std::int64_t number_ = 0;
  std::int64_t seq_ = 0;
  std::int64_t utime_ = 0;     // of the newest message
  std::int64_t ahead_us_ = 0;  // of the stamps before node time
  std::int64_t run_id_ = 0;
  std::int64_t publisher_id_ = 0;
  std::vector<std::uint8_t> bytes_;
  Tap<T> tap_;
};

/// @return null: the name is not a channel of this system
inline std::unique_ptr<DistinctMessages> distinct_messages(Bus* bus, std::string_view channel,
                                                           bool as_owner) {
  std::unique_ptr<DistinctMessages> made;
  (void)channel::with_type_of(channel, [&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    made = std::make_unique<DistinctMessagesOf<T>>(bus, channel, as_owner);
  });
  return made;
}

}  // namespace rcs::live_faults
