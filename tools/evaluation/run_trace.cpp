#include "tools/evaluation/run_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/node/log/log_file.h"

namespace rcs::evaluation {
namespace {

constexpr Duration kSpeedPeriod = std::chrono::milliseconds(100);
constexpr std::size_t kMaxConfigurations = 3;
/// Beyond: a damaged message, whose differences would overflow.
constexpr std::int64_t kMaxUtime = std::int64_t{1} << 60;

bool is_process_channel(std::string_view channel) {
  constexpr std::string_view kEnd = "_PROCESS";
  return channel.size() > kEnd.size() && channel.substr(channel.size() - kEnd.size()) == kEnd;
}

template <class M>
bool decode(const LogEvent& event, M* message) {
  const int size = static_cast<int>(event.data.size());
  return message->decode(event.data.data(), 0, size) == size && message->utime > -kMaxUtime &&
         message->utime < kMaxUtime;
}

class TraceReader {
 public:
  void add(const nav_state_t& m) {
    const Stamp stamp = from_utime(m.utime);
    const double speed_mps = from_message(m.v_world_mps).norm();
    const bool due = trace_.speed.empty() || stamp - trace_.speed.back().stamp >= kSpeedPeriod;
    if (due && std::isfinite(speed_mps)) trace_.speed.push_back({stamp, speed_mps});
  }

  void add(const integrity_t& m) {
    trace_.protection.push_back({from_utime(m.utime), m.protection_horizontal_m,
                                 m.protection_vertical_m, m.limit_horizontal_m,
                                 m.limit_vertical_m});
  }

  void add(const process_t& m) {
    if (m.config.empty()) return;
    const std::string name =
        fmt::format("{} (hash {:016x})", m.config, static_cast<std::uint64_t>(m.config_hash));
    const bool known =
        std::find(configurations_.begin(), configurations_.end(), name) != configurations_.end();
    if (!known && configurations_.size() < kMaxConfigurations) configurations_.push_back(name);
  }

  [[nodiscard]] RunTrace trace() && {
    for (const std::string& name : configurations_) {
      trace_.configuration += (trace_.configuration.empty() ? "" : ", ") + name;
    }
    return std::move(trace_);
  }

 private:
  RunTrace trace_;
  std::vector<std::string> configurations_;
};

}  // namespace

Result<RunTrace> read_trace(const std::string& log) {
  Result<LogReader> reader = LogReader::open(log);
  if (!reader) return reader.error();
  TraceReader trace;
  LogEvent event;
  nav_state_t nav_state{};
  integrity_t integrity{};
  process_t process{};
  while (reader->next(&event)) {
    if (event.channel == channel::kWmNavState) {
      if (decode(event, &nav_state)) trace.add(nav_state);
    } else if (event.channel == channel::kWmIntegrity) {
      if (decode(event, &integrity)) trace.add(integrity);
    } else if (is_process_channel(event.channel)) {
      if (decode(event, &process)) trace.add(process);
    }
  }
  return std::move(trace).trace();
}

}  // namespace rcs::evaluation
