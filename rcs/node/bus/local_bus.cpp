#include "rcs/node/bus/local_bus.h"

#include <algorithm>
#include <tuple>

#include "rcs/base/check.h"

namespace rcs {
namespace {

/// Heap order for std::push_heap: the message to be delivered last is the smallest.
constexpr auto kLater = [](const auto* a, const auto* b) {
  return std::tie(a->due, a->sequence) > std::tie(b->due, b->sequence);
};

}  // namespace

std::size_t LocalBus::channel_index(std::string_view name) {
  // A few dozen channels at most: a linear search is faster than a map, and keeps the order.
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i].name == name) return i;
  }
  channels_.emplace_back().name = name;
  return channels_.size() - 1;
}

void LocalBus::subscribe(std::string_view channel, Receiver* receiver) {
  channels_[channel_index(channel)].receivers.push_back(receiver);
}

void LocalBus::publish(std::string_view channel, const std::uint8_t* data, std::size_t size) {
  const std::size_t index = channel_index(channel);
  Channel& c = channels_[index];
  if (c.free.empty()) c.free.push_back(&pool_.emplace_back());
  Packet* const packet = c.free.back();
  c.free.pop_back();

  // Doubling: sizes that grow slowly must not cause an allocation for each message.
  while (c.packet_bytes < size) c.packet_bytes *= 2;
  packet->data.reserve(c.packet_bytes);
  packet->data.assign(data, data + size);
  packet->due = publish_due_;
  packet->sequence = ++sequence_;
  packet->channel = index;
  queue_.push_back(packet);
  std::push_heap(queue_.begin(), queue_.end(), kLater);
}

Stamp LocalBus::next_due() const { return queue_.empty() ? Stamp::max() : queue_.front()->due; }

void LocalBus::deliver_next(Stamp now) {
  RCS_CHECK(!queue_.empty());
  std::pop_heap(queue_.begin(), queue_.end(), kLater);
  Packet* const packet = queue_.back();
  queue_.pop_back();
  hand_over(packet->channel, packet->data.data(), packet->data.size(), now);
  channels_[packet->channel].free.push_back(packet);
}

void LocalBus::deliver(std::string_view channel, const std::uint8_t* data, std::size_t size,
                       Stamp now) {
  hand_over(channel_index(channel), data, size, now);
}

void LocalBus::hand_over(std::size_t channel, const std::uint8_t* data, std::size_t size,
                         Stamp now) {
  // By index: a receiver may publish, and a new channel moves the others.
  if (tap_ != nullptr) tap_->on_deliver(now, channels_[channel].name, data, size);
  for (std::size_t i = 0; i < channels_[channel].receivers.size(); ++i) {
    channels_[channel].receivers[i]->receive(data, size, now);
  }
}

}  // namespace rcs
