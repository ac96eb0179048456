#pragma once
// What waits to be sent to one client: texts in their order, and the newest message of each
// subscription. The bytes are bounded, so that a slow client costs a bounded memory and no time.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace rcs::view {

/// Shared by all clients that receive the message.
using Payload = std::shared_ptr<const std::vector<std::uint8_t>>;

struct Outgoing {
  std::string text;                ///< of a text message; of data: empty
  std::uint32_t subscription = 0;  ///< of data
  std::uint64_t time_ns = 0;
  Payload payload;  ///< nullptr: a text message
};

class SendQueue {
 public:
  explicit SendQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Replaces the message of the same subscription that waits, in its place. If the bytes exceed
  /// the limit, the messages that wait longest are dropped.
  void push(std::uint32_t subscription, std::uint64_t time_ns, Payload payload);
  /// Messages make room for texts.
  /// @return false: texts alone exceed the limit, and the text was not added
  [[nodiscard]] bool push_text(std::string text);
  /// Texts first.
  [[nodiscard]] std::optional<Outgoing> pop();
  /// Drops the message of a subscription that ended.
  void forget(std::uint32_t subscription);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] bool empty() const { return texts_.empty() && data_.empty(); }
  /// Messages so far that were replaced by newer ones or dropped because of the limit.
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

 private:
  void shed();
  void erase(const std::deque<Outgoing>::const_iterator& at);

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;       ///< waiting, of texts and data
  std::size_t text_bytes_ = 0;  ///< of them, of texts
  std::deque<std::string> texts_;
  std::deque<Outgoing> data_;
  std::int64_t dropped_ = 0;
};

}  // namespace rcs::view
