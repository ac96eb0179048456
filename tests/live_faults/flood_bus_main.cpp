// flood_bus CHANNEL RATE SECONDS [distinct|owner]: publishes on a channel at RATE messages a second
// but at most 100 MB/s. Default: the newest message of the channel byte for byte, every second time
// replaced by garbage; distinct: valid messages that all differ, of another publisher; owner: the
// same with the ids of the channel's publisher.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/live_faults/distinct_messages.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr char kUsage[] = "flood_bus CHANNEL RATE SECONDS [distinct|owner]\n";
constexpr rcs::Duration kListen = rcs::from_seconds(1.5);  // for a message of the channel

struct Newest final : rcs::Receiver {
  void receive(const std::uint8_t* data, std::size_t size,
               rcs::Stamp /*arrival*/) noexcept override {
    bytes.assign(data, data + size);
  }
  Bytes bytes;
};

/// @return false: stopped from outside
bool advance_to(rcs::Stamp next, rcs::LiveTimeline* timeline) {
  rcs::Timeline::Step step = rcs::Timeline::Step::kDelivered;
  while (timeline->now() < next && step == rcs::Timeline::Step::kDelivered) {
    step = timeline->advance(next);
  }
  return step != rcs::Timeline::Step::kEnded;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string mode = argc == 5 ? argv[4] : "";
  const bool known_mode = mode.empty() || mode == "distinct" || mode == "owner";
  if (argc < 4 || argc > 5 || !known_mode) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  const std::string channel = argv[1];
  const double rate_hz = std::atof(argv[2]);                         // NOLINT(cert-err34-c)
  const rcs::Duration span = rcs::from_seconds(std::atof(argv[3]));  // NOLINT(cert-err34-c)
  const rcs::StopSignals stop;
  auto bus = rcs::LcmBus::create("");
  if (!bus) {
    std::fprintf(stderr, "flood_bus: %s\n", bus.error().message.c_str());
    return 3;
  }
  Newest newest;
  std::unique_ptr<rcs::live_faults::DistinctMessages> distinct;
  if (mode.empty()) {
    (*bus)->subscribe(channel, &newest);
  } else {
    distinct = rcs::live_faults::distinct_messages(bus->get(), channel, mode == "owner");
    if (distinct == nullptr) {
      std::fputs(kUsage, stderr);
      return 2;
    }
  }
  rcs::LiveTimeline timeline(bus->get(), &stop);
  const Bytes garbage(200, 0xa5);
  if (distinct != nullptr && !advance_to(timeline.now() + kListen, &timeline)) return 0;
  const rcs::Stamp begin = timeline.now();
  double sent = 0.0;
  double bytes = 0.0;
  while (timeline.now() - begin < span) {
    if (!advance_to(timeline.now() + rcs::from_milliseconds(5.0), &timeline)) break;
    const double elapsed_s = rcs::seconds(timeline.now() - begin);
    const Bytes copy = newest.bytes.empty() ? garbage : newest.bytes;
    for (; sent < rate_hz * elapsed_s && bytes < 1e8 * elapsed_s; ++sent) {
      const bool even = static_cast<long>(sent) % 2 == 0;
      const Bytes& m = distinct != nullptr ? distinct->next(timeline.now()) : even ? copy : garbage;
      (*bus)->publish(channel, m.data(), m.size());
      bytes += static_cast<double>(m.size());
    }
  }
  std::printf("%.0f messages, %.0f MB\n", sent, bytes * 1e-6);
  return 0;
}
