#pragma once
// Messages from the datagrams of LCM's protocol "udpm" (LC02: a message; LC03: a fragment of one).
// Pure, and safe for any bytes: liblcm's own receiver crashes on malformed fragments. Memory grows
// with the bytes that arrive, not with the sizes that a datagram claims.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// Source of a datagram, as in sockaddr_in.
struct UdpmSender {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
};

/// Valid until the next datagram.
struct UdpmMessage {
  std::string_view channel;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

class UdpmAssembler {
 public:
  static constexpr std::size_t kMaxChannel = 63;                    ///< characters, as in liblcm
  static constexpr std::size_t kMaxMessage = std::size_t{8} << 20;  ///< bytes
  /// Messages in progress, one a sender; the one that has waited for longest makes room.
  static constexpr std::size_t kMaxPartial = 8;

  struct Account {
    std::int64_t malformed = 0;   ///< datagrams that are not of the protocol or contradict others
    std::int64_t incomplete = 0;  ///< messages of which a fragment was lost or came out of order
  };

  /// @param wanted  whether a channel is subscribed to; fragments of others take no memory
  /// @return the message that this datagram is, or completes
  template <class Wanted>
  std::optional<UdpmMessage> add(const UdpmSender& from, const std::uint8_t* data, std::size_t size,
                                 const Wanted& wanted) {
    const std::optional<Datagram> d = parse(data, size);
    if (!d) return std::nullopt;
    const bool begins = d->count == 0 || d->number == 0;
    if (begins && !wanted(d->channel)) {
      if (d->count != 0) forget(from);
      return std::nullopt;
    }
    if (d->count == 0) return UdpmMessage{d->channel, d->data, d->size};
    return add_fragment(from, *d);
  }

  [[nodiscard]] const Account& account() const { return account_; }

 private:
  struct Datagram {
    std::uint32_t sequence = 0;
    std::uint32_t message_size = 0;
    std::uint32_t offset = 0;
    std::uint16_t number = 0;
    std::uint16_t count = 0;   // of fragments; 0: a whole message
    std::string_view channel;  // of a whole message, or of the first fragment
    const std::uint8_t* data = nullptr;
    std::size_t size = 0;
  };
  struct Partial {
    UdpmSender from;
    bool used = false;
    std::int64_t touched = 0;  // number of the newest fragment
    std::uint32_t sequence = 0;
    std::uint32_t message_size = 0;
    std::uint16_t next = 0;
    std::uint16_t count = 0;
    std::string channel;
    std::vector<std::uint8_t> data;
  };

  std::optional<Datagram> parse(const std::uint8_t* data, std::size_t size);
  bool take_channel(Datagram* d);
  std::optional<UdpmMessage> add_fragment(const UdpmSender& from, const Datagram& d);
  Partial* find(const UdpmSender& from);
  Partial* begin(const UdpmSender& from, const Datagram& d);
  void forget(const UdpmSender& from);

  std::vector<Partial> partials_;
  std::int64_t fragments_ = 0;
  Account account_;
};

}  // namespace rcs
