// flood_bus CHANNEL RATE SECONDS: repeats the newest message of a channel byte for byte, every
// second time replaced by garbage, at RATE messages a second but at most 100 MB/s.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

struct Newest final : rcs::Receiver {
  void receive(const std::uint8_t* data, std::size_t size,
               rcs::Stamp /*arrival*/) noexcept override {
    bytes.assign(data, data + size);
  }
  Bytes bytes;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "flood_bus CHANNEL RATE SECONDS\n");
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
  (*bus)->subscribe(channel, &newest);
  rcs::LiveTimeline timeline(bus->get(), &stop);
  const Bytes garbage(200, 0xa5);
  const rcs::Stamp begin = timeline.now();
  double sent = 0.0;
  double bytes = 0.0;
  while (timeline.now() - begin < span) {
    const rcs::Stamp next = timeline.now() + rcs::from_milliseconds(5.0);
    rcs::Timeline::Step step = rcs::Timeline::Step::kDelivered;
    while (timeline.now() < next && step == rcs::Timeline::Step::kDelivered) {
      step = timeline.advance(next);
    }
    if (step == rcs::Timeline::Step::kEnded) break;
    const double elapsed_s = rcs::seconds(timeline.now() - begin);
    const Bytes copy = newest.bytes.empty() ? garbage : newest.bytes;
    for (; sent < rate_hz * elapsed_s && bytes < 1e8 * elapsed_s; ++sent) {
      const Bytes& m = static_cast<long>(sent) % 2 == 0 ? copy : garbage;
      (*bus)->publish(channel, m.data(), m.size());
      bytes += static_cast<double>(m.size());
    }
  }
  std::printf("%.0f messages, %.0f MB\n", sent, bytes * 1e-6);
  return 0;
}
