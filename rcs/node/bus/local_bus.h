#pragma once
// A bus inside one process: replay, simulation, tests. Deterministic: a LockstepTimeline delivers
// the messages in the order of (due, sequence).

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"

namespace rcs {

/// Receives every message of a LocalBus at the moment of its delivery, hence in time order; e.g. a
/// LogRecorder.
class BusTap {
 public:
  virtual void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                          std::size_t size) = 0;

 protected:
  ~BusTap() = default;
};

/// No allocation after warm-up, when all channels, message sizes and queue lengths have occurred.
class LocalBus final : public Bus {
 public:
  void subscribe(std::string_view channel, Receiver* receiver) override;
  /// Queues a copy, due at the time last given to set_publish_due().
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override;

  void set_tap(BusTap* tap) { tap_ = tap; }  ///< null: none
  void set_publish_due(Stamp due) { publish_due_ = due; }

  [[nodiscard]] Stamp next_due() const;  ///< Stamp::max() when nothing is queued
  /// Delivers the first message of the queue, which must not be empty, with arrival `now`.
  void deliver_next(Stamp now);
  /// Delivers a message from outside (a sensor, a log) directly, without the queue.
  void deliver(std::string_view channel, const std::uint8_t* data, std::size_t size, Stamp now);

 private:
  struct Packet {
    Stamp due;
    std::uint64_t sequence = 0;
    std::size_t channel = 0;
    std::vector<std::uint8_t> data;
  };
  struct Channel {
    std::string name;
    std::vector<Receiver*> receivers;
    std::vector<Packet*> free;       // by channel: a channel's messages are of similar sizes
    std::size_t packet_bytes = 512;  // capacity of its packets
  };

  std::size_t channel_index(std::string_view name);
  void hand_over(std::size_t channel, const std::uint8_t* data, std::size_t size, Stamp now);

  std::vector<Channel> channels_;
  std::deque<Packet> pool_;     // addresses stay
  std::vector<Packet*> queue_;  // a heap
  std::uint64_t sequence_ = 0;
  Stamp publish_due_ = Stamp::min();
  BusTap* tap_ = nullptr;
};

}  // namespace rcs
