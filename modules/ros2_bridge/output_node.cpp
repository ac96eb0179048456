#include "modules/ros2_bridge/output_node.h"

#include <algorithm>
#include <cstdlib>
#include <type_traits>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "rcs/node/bus/inbox.h"

namespace rcs::ros2_bridge {
namespace {

/// The times and ids with which every message begins: fingerprint, utime, seq, run_id and
/// publisher_id, big-endian.
struct MessageHead {
  std::int64_t utime = 0;
  Publisher from;
};

std::int64_t take_big_endian(const std::uint8_t* data) {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8U | data[i];
  return static_cast<std::int64_t>(value);
}

bool read_head(const std::uint8_t* data, std::size_t size, MessageHead* head) {
  if (size < 40 || size > InboxBase::kMaxMessageBytes) return false;
  head->utime = take_big_endian(data + 8);
  head->from.run_id = take_big_endian(data + 24);
  head->from.publisher_id = take_big_endian(data + 32);
  return true;
}

template <class T>
Duration period_of(const ros2::Topic<T>& /*topic*/, const OutputConfig& config) {
  if constexpr (std::is_same_v<T, ros2::msg::PointCloud2>) return config.cloud_period;
  if constexpr (std::is_same_v<T, ros2::msg::OccupancyGrid> ||
                std::is_same_v<T, ros2::msg::GridMap>) {
    return config.map_period;
  }
  // Messages of these topics are not states: the next one does not replace the one before.
  if constexpr (std::is_same_v<T, ros2::msg::Log> ||
                std::is_same_v<T, ros2::msg::DiagnosticArray>) {
    return Duration::zero();
  }
  return config.period;
}

ros2::ConverterOptions converter_options(const Ros2BridgeConfig& config) {
  ros2::ConverterOptions options;
  options.original = false;
  options.T_vehicle_ladar = config.T_vehicle_ladar;
  return options;
}

bool selected(const OutputConfig& config, std::string_view topic) {
  return std::find(config.topics.begin(), config.topics.end(), topic) != config.topics.end();
}

}  // namespace

std::vector<std::string> channels_of(std::string_view from) {
  std::vector<std::string> all;
  while (!from.empty()) {
    const std::size_t comma = std::min(from.find(", "), from.size());
    const std::string_view name = from.substr(0, comma);
    from.remove_prefix(std::min(comma + 2, from.size()));
    for (const channel::Info& info : channel::kAll) {
      const std::string_view channel = info.name;
      const std::string_view end = name.substr(1);
      const bool matches =
          name.front() == '*'
              ? channel.size() > end.size() && channel.substr(channel.size() - end.size()) == end
              : channel == name;
      if (matches) all.emplace_back(channel);
    }
  }
  return all;
}

std::vector<DdsOutput> outputs_of(const OutputConfig& config) {
  std::vector<DdsOutput> all;
  ros2::for_each_topic([&](const auto& topic) {
    if (!selected(config, topic.name)) return;
    using T = typename std::decay_t<decltype(topic)>::Message;
    // As ROS 2 itself publishes it: a late subscriber receives the newest entries.
    const bool kept = std::is_same_v<T, ros2::msg::Log>;
    all.push_back({topic.name, ros2::type_name<T>(), kept});
  });
  return all;
}

BusToRos2::Source::Source(BusToRos2* parent, std::string channel, std::int64_t run_id,
                          bool published)
    : parent_(parent),
      channel_(std::move(channel)),
      owner_(ownership_of(channel_), run_id),
      published_(published) {}

void BusToRos2::Source::receive(const std::uint8_t* data, std::size_t size,
                                Stamp arrival) noexcept {
  MessageHead head;
  if (!read_head(data, size, &head) ||
      owner_.judge(head.from, arrival) != ChannelOwner::Verdict::kAccepted) {
    ++parent_->counts_.malformed;
    return;
  }
  (void)owner_.accept(head.from, arrival);
  if (channel::is_sensor(channel_)) parent_->measured_.add(channel_, head.utime, arrival);
  if (published_) parent_->push(channel_, data, size);
}

BusToRos2::BusToRos2(const Ros2BridgeConfig& config, Bus* bus, Write write)
    : sensor_clock_(config.sensor_clock),
      write_(std::move(write)),
      budget_(config.output.max_bytes_per_s),
      converter_(converter_options(config), this) {
  std::vector<std::string> published;
  ros2::for_each_topic([&](const auto& topic) {
    if (!selected(config.output, topic.name)) return;
    outputs_.push_back({topic.name, Decimator(period_of(topic, config.output))});
    for (std::string& channel : channels_of(topic.from)) published.push_back(std::move(channel));
  });
  if (outputs_.empty()) return;
  const auto run_id = bus->publisher().run_id;
  for (const channel::Info& info : channel::kAll) {
    const bool wanted = std::count(published.begin(), published.end(), info.name) > 0;
    const bool times = sensor_clock_ == SensorClock::kMeasured && channel::is_sensor(info.name);
    if (!wanted && !times) continue;
    bus->subscribe(info.name, &sources_.emplace_back(this, info.name, run_id, wanted));
  }
  waiting_.resize(kMaxWaiting);
}

void BusToRos2::push(std::string_view channel, const std::uint8_t* data, std::size_t size) {
  if (used_ == waiting_.size()) {
    ++counts_.waiting;
    return;
  }
  Waiting& slot = waiting_[used_++];
  slot.channel = channel;
  slot.bytes.assign(data, data + size);
}

/// Without a message of a sensor, sensor time is unknown: a wrong stamp would be worse than none.
bool BusToRos2::has_clock(std::string_view channel) const {
  return sensor_clock_ != SensorClock::kMeasured || measured_.knows_sensors() ||
         ros2::clock_of(channel) == ros2::ChannelClock::kNode;
}

ros2::ClockOffsets BusToRos2::clocks(std::int64_t utc_minus_node_us) const {
  ros2::ClockOffsets out;
  out.node_us = utc_minus_node_us;
  if (sensor_clock_ == SensorClock::kNode) out.sensor_us = utc_minus_node_us;
  if (sensor_clock_ == SensorClock::kMeasured) {
    out.sensor_us = measured_.offsets().sensor_us + utc_minus_node_us;
    // Sensors that agree with UTC have UTC: the difference is their delay.
    if (std::abs(out.sensor_us) < ros2::ClockEstimate::kSame.count()) out.sensor_us = 0;
  }
  return out;
}

void BusToRos2::run(std::int64_t utc_minus_node_us, Stamp now, Report* report) {
  now_ = now;
  converter_.set_clocks(clocks(utc_minus_node_us));
  for (std::size_t i = 0; i < used_; ++i) {
    const Waiting& message = waiting_[i];
    if (!has_clock(message.channel)) continue;
    const ros2::Conversion done =
        converter_.convert(message.channel, message.bytes.data(), message.bytes.size());
    if (done != ros2::Conversion::kDone) ++counts_.malformed;
  }
  used_ = 0;
  report_losses(now, report);
}

void BusToRos2::publish(std::string_view topic, const ros2::Schema& /*schema*/,
                        const std::vector<std::uint8_t>& cdr) {
  const auto at = std::find_if(outputs_.begin(), outputs_.end(),
                               [&](const Output& o) { return o.topic == topic; });
  if (at == outputs_.end()) return;
  if (!at->decimator.admit(now_)) {
    ++counts_.decimated;
    return;
  }
  switch (budget_.take(cdr.size(), now_)) {
    case ByteBudget::Verdict::kExhausted:
      ++counts_.over_budget;
      return;
    case ByteBudget::Verdict::kTooLarge:
      ++counts_.too_large;
      return;
    case ByteBudget::Verdict::kGranted:
      break;
  }
  const bool written = write_(static_cast<std::size_t>(at - outputs_.begin()), cdr);
  ++(written ? counts_.written : counts_.dds_failures);
}

void BusToRos2::report_losses(Stamp now, Report* report) {
  const auto dropped = [](const Counts& c) { return c.over_budget + c.too_large + c.waiting; };
  if (dropped(counts_) != dropped(reported_)) {
    report->publish(now, event::kRos2BridgeOutputDropped,
                    "{} messages to ROS 2 dropped so far: byte budget exhausted {}, larger than "
                    "the byte budget {}, more than {} waited {}",
                    dropped(counts_), counts_.over_budget, counts_.too_large, kMaxWaiting,
                    counts_.waiting);
  }
  if (counts_.dds_failures != reported_.dds_failures) {
    report->publish(now, event::kRos2BridgeDdsWrite, "{} samples rejected by DDS so far and lost",
                    counts_.dds_failures);
  }
  reported_ = counts_;
}

}  // namespace rcs::ros2_bridge
