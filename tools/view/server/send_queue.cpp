#include "tools/view/server/send_queue.h"

#include <algorithm>
#include <utility>

namespace rcs::view {

void SendQueue::push(std::uint32_t subscription, std::uint64_t time_ns, Payload payload) {
  const std::size_t size = payload->size();
  const auto at = std::find_if(data_.begin(), data_.end(), [subscription](const Outgoing& waiting) {
    return waiting.subscription == subscription;
  });
  if (size > max_bytes_) {
    ++dropped_;
    return;
  }
  if (at != data_.end()) {
    ++dropped_;
    bytes_ += size - at->payload->size();
    at->time_ns = time_ns;
    at->payload = std::move(payload);
  } else {
    bytes_ += size;
    data_.push_back({"", subscription, time_ns, std::move(payload)});
  }
  shed();
}

void SendQueue::shed() {
  while (bytes_ > max_bytes_ && !data_.empty()) {
    ++dropped_;
    erase(data_.begin());
  }
}

bool SendQueue::push_text(std::string text) {
  if (text_bytes_ + text.size() > max_bytes_) return false;
  text_bytes_ += text.size();
  bytes_ += text.size();
  texts_.push_back(std::move(text));
  shed();
  return true;
}

std::optional<Outgoing> SendQueue::pop() {
  std::optional<Outgoing> out;
  if (!texts_.empty()) {
    out.emplace();
    out->text = std::move(texts_.front());
    texts_.pop_front();
    text_bytes_ -= out->text.size();
    bytes_ -= out->text.size();
  } else if (!data_.empty()) {
    out = std::move(data_.front());
    data_.pop_front();
    bytes_ -= out->payload->size();
  }
  return out;
}

void SendQueue::forget(std::uint32_t subscription) {
  const auto at = std::find_if(data_.begin(), data_.end(), [subscription](const Outgoing& waiting) {
    return waiting.subscription == subscription;
  });
  if (at != data_.end()) erase(at);
}

void SendQueue::erase(const std::deque<Outgoing>::const_iterator& at) {
  bytes_ -= at->payload->size();
  data_.erase(at);
}

}  // namespace rcs::view
