#pragma once
// The newest messages of one channel, decoded into reused slots, with counts of the messages
// received, dropped, missing, malformed, and rejected because of their publisher.

#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/base/check.h"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/channel_owner.h"
#include "rcs/node/bus/message_size.h"

namespace rcs {

/// The type-independent part.
class InboxBase : public Receiver {
 public:
  struct Account {
    std::int64_t received = 0;
    std::int64_t dropped = 0;           ///< overwritten before they were read
    std::int64_t gaps = 0;              ///< missing in seq
    std::int64_t late = 0;              ///< received after a message with a higher seq
    std::int64_t repeated = 0;          ///< datagrams that were received before; dropped
    std::int64_t malformed = 0;         ///< not decodable, or with bytes left over
    Stamp newest = Stamp::min();        ///< largest utime so far: sensor time
    Stamp last_arrival = Stamp::min();  ///< node time
    std::int64_t rejected = 0;          ///< of another publisher than the owner of the channel
    Publisher rejected_of;              ///< of the newest of them
    Stamp rejected_at = Stamp::min();   ///< its arrival
    std::int64_t owner_changes = 0;     ///< another publisher became the owner of the channel
    Publisher owner_before;             ///< of the newest change
    Duration owner_silent{};            ///< how long that one had been silent then

    /// Time since the last arrival, in node time; -1 us: none yet.
    [[nodiscard]] Duration age(Stamp now) const {
      return received == 0 ? Duration(-1) : now - last_arrival;
    }
  };
  /// The largest limit of all types; that of a type is kMaxEncodedBytes.
  static constexpr std::size_t kMaxMessageBytes = kMaxEncodedBytes<ladar_points_t>;

  [[nodiscard]] std::string_view channel() const { return channel_; }
  [[nodiscard]] const Account& account() const { return account_; }
  [[nodiscard]] bool has_owner() const { return owner_.known(); }
  [[nodiscard]] const Publisher& owner() const { return owner_.owner(); }
  /// A message of another publisher was rejected within this time.
  [[nodiscard]] bool contested(Stamp now, Duration within) const {
    return account_.rejected_at != Stamp::min() && now - account_.rejected_at <= within;
  }
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }

  /// Arrival of the oldest waiting message; Stamp::max() if none waits.
  [[nodiscard]] Stamp oldest_arrival() const { return empty() ? Stamp::max() : arrivals_[head_]; }

 protected:
  InboxBase(const Bus& bus, std::string_view channel, std::size_t depth,
            std::optional<ChannelOwner::Rule> rule)
      : channel_(channel),
        is_command_(channel::is_command(channel)),
        arrivals_(depth, Stamp::min()) {
    RCS_CHECK(depth > 0);
    if (rule || bus.owners_required()) {
      owner_ = ChannelOwner(rule.value_or(ownership_of(channel)), bus.publisher().run_id);
    }
  }
  ~InboxBase() = default;

  /// The slot for the next message; a full inbox overwrites its oldest message (freshest first).
  std::size_t claim() {
    if (count_ == arrivals_.size()) {
      head_ = (head_ + 1) % arrivals_.size();
      --count_;
      ++account_.dropped;
    }
    return (head_ + count_) % arrivals_.size();
  }
  /// Whether the message is to be stored: of the owner of the channel, and not a copy.
  template <class T>
  [[nodiscard]] bool admits(const T& m, Stamp arrival) {
    const Publisher from{m.run_id, m.publisher_id};
    if (owner_.judge(from, arrival) != ChannelOwner::Verdict::kAccepted) {
      ++account_.rejected;
      account_.rejected_of = from;
      account_.rejected_at = arrival;
      return false;
    }
    // Before the owner's silence is measured: copies of its messages do not keep it alive.
    if (numbered(from) && owner_.is(from) && is_copy(m.seq, from_utime(m.utime))) {
      ++account_.repeated;
      return false;
    }
    const Publisher before = owner_.owner();
    if (owner_.accept(from, arrival)) {
      seen_ = 0;
      if (owner_.exclusive()) note_change(before, arrival);
    }
    return true;
  }
  /// Several superiors without an id cannot be distinguished, and each has numbers of its own.
  [[nodiscard]] bool numbered(const Publisher& from) const {
    return !is_command_ || from.publisher_id != 0;
  }
  void note_change(const Publisher& before, Stamp arrival) {
    ++account_.owner_changes;
    account_.owner_before = before;
    account_.owner_silent = arrival - account_.last_arrival;
  }
  [[nodiscard]] bool is_copy(std::int64_t seq, Stamp utime) const;
  void commit(std::size_t slot, Stamp arrival, std::int64_t seq, Stamp utime);
  void drop_front() {
    RCS_CHECK(count_ > 0);
    head_ = (head_ + 1) % arrivals_.size();
    --count_;
  }

  static constexpr std::uint64_t kMaxGap = 1'000'000;

  std::string channel_;
  bool is_command_;
  std::vector<Stamp> arrivals_;
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  std::int64_t last_seq_ = 0;
  std::uint64_t seen_ = 0;  // bit k: last_seq_ - k was received; 0: nothing
  ChannelOwner owner_;
  Account account_;
};

/// UDP may deliver a datagram twice, also out of order. A driver that restarts, or does not count,
/// repeats numbers and not times.
inline bool InboxBase::is_copy(std::int64_t seq, Stamp utime) const {
  if (seq <= 0 || seq > last_seq_ || utime > account_.newest) return false;
  const std::int64_t back = last_seq_ - seq;
  return back < 64 && ((seen_ >> back) & 1U) != 0;
}

inline void InboxBase::commit(std::size_t slot, Stamp arrival, std::int64_t seq, Stamp utime) {
  arrivals_[slot] = arrival;
  ++count_;
  ++account_.received;
  account_.last_arrival = arrival;
  // Unsigned, because seq is untrusted input and the difference of two int64 may overflow.
  const std::uint64_t ahead =
      static_cast<std::uint64_t>(seq) - static_cast<std::uint64_t>(last_seq_);
  if (seen_ == 0 || seq <= 0 || seq == 1) {  // NOLINT(bugprone-branch-clone): two causes
    // The first message, one without a number, or a restarted writer: no gap.
    seen_ = 1;
    last_seq_ = seq;
  } else if (seq > last_seq_) {
    // A gap larger than kMaxGap is an invalid number and counts once.
    const std::uint64_t lost = ahead - 1;
    account_.gaps += lost <= kMaxGap ? static_cast<std::int64_t>(lost) : 1;
    seen_ = ahead < 64 ? (seen_ << ahead) | 1U : 1U;
    last_seq_ = seq;
  } else if (const std::uint64_t back = 0 - ahead; back < 64) {
    ++account_.late;
    if (account_.gaps > 0) --account_.gaps;
    seen_ |= std::uint64_t{1} << back;
  } else {
    seen_ = 1;
    last_seq_ = seq;
  }
  if (utime > account_.newest) account_.newest = utime;
}

/// FIFO of the newest `depth` messages of type T on one channel.
template <class T>
class Inbox final : public InboxBase {
 public:
  /// @param rule  none: that of the channel on a bus that requires owners
  Inbox(Bus* bus, std::string_view channel, std::size_t depth,
        std::optional<ChannelOwner::Rule> rule = std::nullopt)
      : InboxBase(*bus, channel, depth, rule), slots_(depth) {
    bus->subscribe(channel, this);
  }
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;
  ~Inbox() = default;

  /// The oldest waiting message, or null; valid until pop() or the next advance().
  [[nodiscard]] const T* front() const { return empty() ? nullptr : &slots_[head_]; }
  [[nodiscard]] Stamp front_arrival() const { return oldest_arrival(); }
  void pop() { drop_front(); }

  /// Drops all messages but the newest and returns it; null if none waits.
  [[nodiscard]] const T* latest() {
    while (count_ > 1) drop_front();
    return front();
  }

  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
    // Decoded into the scratch message first: a malformed packet must not displace a valid one.
    if (!decode(data, size)) {
      ++account_.malformed;
      return;
    }
    if (!admits(scratch_, arrival)) return;
    const std::size_t slot = claim();
    std::swap(slots_[slot], scratch_);  // both keep their buffers: no allocation after warm-up
    commit(slot, arrival, slots_[slot].seq, from_utime(slots_[slot].utime));
  }

 private:
  bool decode(const std::uint8_t* data, std::size_t size) noexcept {
    if (size > kMaxEncodedBytes<T>) return false;
    try {
      return scratch_.decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
    } catch (const std::bad_alloc&) {
      return false;  // lengths are bounded by the packet, but an allocation can still fail
    }
  }

  std::vector<T> slots_;
  T scratch_{};
};

}  // namespace rcs
