#pragma once
// Transport of encoded messages between nodes. Two kinds: LcmBus (live) and LocalBus (one process,
// deterministic: replay, simulation, tests).

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/publisher.h"

namespace rcs {

/// Receives the bytes of one channel. Called within Timeline::advance, on the node's thread.
class Receiver {
 public:
  virtual void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept = 0;

 protected:
  ~Receiver() = default;
};

class Bus {
 public:
  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
  virtual ~Bus() = default;

  /// `receiver` must outlive the last advance(). Several receivers may share a channel.
  virtual void subscribe(std::string_view channel, Receiver* receiver) = 0;
  virtual void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) = 0;

  /// Sets the ids for every Outbox that is created afterwards.
  void set_publisher(const Publisher& publisher) { publisher_ = publisher; }
  [[nodiscard]] const Publisher& publisher() const { return publisher_; }

  /// Every Inbox that is created afterwards listens to one publisher of its channel. For nodes:
  /// tools listen to everyone, and in lockstep there is nobody else.
  void require_owners() { owners_required_ = true; }
  [[nodiscard]] bool owners_required() const { return owners_required_; }

  /// Number of the newest message of a channel, shared by its outboxes.
  [[nodiscard]] std::int64_t* sequence_of(std::string_view channel) {
    return &sequences_[std::string(channel)];
  }

 private:
  Publisher publisher_;
  bool owners_required_ = false;
  std::map<std::string, std::int64_t> sequences_;
};

}  // namespace rcs
