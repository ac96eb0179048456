#include "rcs/node/bus/lcm_bus.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "rcs/base/check.h"
#include "rcs/node/bus/bus_url.h"

namespace rcs {
namespace {

/// Queue length of LCM for one subscription. A full LCM queue drops the newest message silently, so
/// the length is chosen never to be reached: the inboxes drop messages, and count them.
constexpr int kQueueMessages = 10'000;

constexpr Duration kLongestWait = from_seconds(1.0);  // limit for the first message

}  // namespace

Result<std::unique_ptr<LcmBus>> LcmBus::create(const std::string& url) {
  const char* env = std::getenv("LCM_DEFAULT_URL");  // NOLINT(concurrency-mt-unsafe)
  std::string chosen = !url.empty() ? url : env != nullptr && *env != '\0' ? env : kDefaultLcmUrl;
  if (Outcome valid = check_bus_url(chosen); !valid) return valid.error();
  lcm_t* lcm = nullptr;
  {
    const SilencedStderr silenced;
    lcm = lcm_create(chosen.c_str());
  }
  if (lcm == nullptr) return Error{bus_advice(chosen)};
  std::unique_ptr<LcmBus> bus(new LcmBus(lcm, std::move(chosen)));
  bus->set_publisher({live_run_id(0), random_id(), boot_id()});
  return bus;
}

void LcmBus::subscribe(std::string_view channel, Receiver* receiver) {
  subscribe(std::string(channel), Subscription{this, receiver, nullptr});
}

// LCM interprets the name of a channel as a regular expression.
void LcmBus::subscribe_all(BusMonitor* monitor) {
  subscribe(".*", Subscription{this, nullptr, monitor});
}

void LcmBus::subscribe(const std::string& pattern, const Subscription& subscription) {
  if (!failure_.empty()) return;  // each further attempt would take a second
  Subscription& s = subscriptions_.emplace_back(subscription);
  lcm_subscription_t* handle = nullptr;
  {
    const SilencedStderr silenced;  // the first subscription tests the bus
    handle = lcm_subscribe(lcm_.get(), pattern.c_str(), &LcmBus::on_message, &s);
  }
  if (handle == nullptr) {
    failure_ = bus_advice(url_);
    return;
  }
  lcm_subscription_set_queue_capacity(handle, kQueueMessages);
}

void LcmBus::publish(std::string_view channel, const std::uint8_t* data, std::size_t size) {
  channel_ = channel;
  const int sent = lcm_publish(lcm_.get(), channel_.c_str(), data, static_cast<unsigned>(size));
  if (sent != 0) ++publish_failures_;
}

bool LcmBus::deliver_one(Stamp now, std::int64_t wall_utime) {
  now_ = now;
  wall_utime_ = wall_utime;
  const int handled = lcm_handle_timeout(lcm_.get(), 0);
  if (handled < 0) failure_ = "LCM stopped receiving on " + url_;
  return handled > 0;
}

int LcmBus::fd() const { return lcm_get_fileno(lcm_.get()); }

Outcome LcmBus::status() const {
  return failure_.empty() ? Outcome(Done{}) : Outcome(Error{failure_});
}

Stamp LcmBus::arrival(std::int64_t received_utime) {
  const std::int64_t waited = wall_utime_ > 0 ? wall_utime_ - received_utime : 0;
  const std::int64_t most =
      last_arrival_ == Stamp::min() ? kLongestWait.count() : (now_ - last_arrival_).count();
  last_arrival_ =
      now_ - Duration(std::clamp<std::int64_t>(waited, 0, std::max<std::int64_t>(0, most)));
  return last_arrival_;
}

// noexcept: an exception through LCM's C frames would leave its object unusable.
void LcmBus::on_message(const lcm_recv_buf_t* packet, const char* channel,
                        void* subscription) noexcept {
  const Subscription& s = *static_cast<const Subscription*>(subscription);
  const auto* const data = static_cast<const std::uint8_t*>(packet->data);
  if (s.monitor != nullptr) {
    s.monitor->receive(channel, data, packet->data_size, packet->recv_utime);
    return;
  }
  s.receiver->receive(data, packet->data_size, s.bus->arrival(packet->recv_utime));
}

}  // namespace rcs
