#include "tools/rcs/vehicle/sensor_watch.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::cli {

void SensorWatch::on_cycle(const cycle_t& cycle) {
  for (const input_account_t& input : cycle.input) {
    if (input.received <= 0) continue;
    for (Sensor& s : sensors_) {
      const bool its =
          std::find(s.channels.begin(), s.channels.end(), input.channel) != s.channels.end();
      s.received = s.received || its;
    }
  }
}

std::vector<std::string> SensorWatch::due(Stamp now) {
  std::vector<std::string> lines;
  if (now - start_ < kPatience) return lines;
  for (Sensor& s : sensors_) {
    if (s.name == "LADAR" && !with_ladar_) continue;
    const std::string channels(s.channels[1].empty()
                                   ? std::string(s.channels[0])
                                   : fmt::format("{} or {}", s.channels[0], s.channels[1]));
    if (s.received && s.reported) {
      lines.push_back(fmt::format("{}: first data received on {}", s.name, channels));
      s.reported = false;
    } else if (!s.received && !s.reported) {
      lines.push_back(
          fmt::format("{}: no data received on {} since the start {:.0f} s ago; check {}", s.name,
                      channels, seconds(now - start_), s.driver));
      s.reported = true;
    }
  }
  return lines;
}

}  // namespace rcs::cli
