#include "rcs/node/bus/lcm_bus.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "rcs/node/bus/bus_exposure.h"
#include "rcs/node/bus/bus_url.h"

namespace rcs {
namespace {

/// The channel on which liblcm tests a bus; its programs ignore it.
constexpr char kTestChannel[] = "LCM_SELF_TEST";
constexpr int kTests = 20;
constexpr int kTestWait_ms = 50;

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
  Result<std::unique_ptr<UdpmReceiver>> receiver = UdpmReceiver::open(parse_bus_address(chosen));
  if (!receiver) {
    lcm_destroy(lcm);
    return Error{fmt::format("{} ({})", bus_advice(chosen), receiver.error().message)};
  }
  std::unique_ptr<LcmBus> bus(new LcmBus(lcm, std::move(receiver).value(), std::move(chosen)));
  if (!bus->test_reception()) return Error{bus_advice(bus->url())};
  bus->set_publisher({live_run_id(0), random_id(), boot_id()});
  return bus;
}

/// Whether messages that this process sends come back: a firewall may drop them.
bool LcmBus::test_reception() {
  receiver_->want(kTestChannel);
  bool received = false;
  for (int k = 0; k < kTests && !received; ++k) {
    publish(kTestChannel, nullptr, 0);
    pollfd ready{fd(), POLLIN, 0};
    received = poll(&ready, 1, kTestWait_ms) > 0;
  }
  receiver_->unwant(kTestChannel);
  while (receiver_->take(&message_)) {
  }
  return received;
}

void LcmBus::subscribe(std::string_view channel, Receiver* receiver) {
  subscriptions_.push_back({std::string(channel), receiver});
  receiver_->want(channel);
}

void LcmBus::subscribe_all(BusMonitor* monitor) {
  monitor_ = monitor;
  receiver_->want("*");
}

void LcmBus::publish(std::string_view channel, const std::uint8_t* data, std::size_t size) {
  channel_ = channel;
  const int sent = lcm_publish(lcm_.get(), channel_.c_str(), data, static_cast<unsigned>(size));
  if (sent != 0) ++publish_failures_;
}

bool LcmBus::deliver_one(Stamp now, std::int64_t wall_utime) {
  now_ = now;
  wall_utime_ = wall_utime;
  if (!receiver_->take(&message_)) {
    if (const std::string why = receiver_->failure(); !why.empty()) {
      failure_ = fmt::format("{}: nothing is received any more: {}", url_, why);
    }
    return false;
  }
  const std::uint8_t* const data = message_.data.data();
  const std::size_t size = message_.data.size();
  if (monitor_ != nullptr) {
    monitor_->receive(message_.channel, data, size, message_.received_utime);
  }
  for (const Subscription& s : subscriptions_) {
    if (!matches(s.channel, message_.channel)) continue;
    s.receiver->receive(data, size, arrival(message_.received_utime));
  }
  return true;
}

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

}  // namespace rcs
