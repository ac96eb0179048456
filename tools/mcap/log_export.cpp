#include "tools/mcap/log_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "lcmtypes/channel_types.h"
#include "tools/mcap/ladar_facets.h"

namespace rcs::mcap {
namespace {

ros2::ConverterOptions converter_options(const ExportOptions& options) {
  ros2::ConverterOptions out;
  out.standard = options.standard;
  out.original = options.original;
  out.clocks = options.clocks;
  if (options.ladar) {
    out.T_vehicle_ladar = options.ladar->T_vehicle_mount;
    out.points_of_ranges = FacetPoints(*options.ladar);
  }
  return out;
}

}  // namespace

std::string fingerprint_of(std::string_view channel) {
  std::string text;
  channel::with_type_of(channel, [&text](const auto* type) {
    text = fmt::format(
        "{:016x}", static_cast<std::uint64_t>(std::remove_pointer_t<decltype(type)>::getHash()));
  });
  return text;
}

LogExport::LogExport(const ExportOptions& options, ByteSink* sink)
    : writer_(options.writer, sink),
      converter_(converter_options(options), this),
      has_ladar_(options.ladar.has_value() || !options.standard) {
  // At the beginning, so that a truncated file has it.
  writer_.add_metadata(kClockRecord, {{kSensorOffset, std::to_string(options.clocks.sensor_us)},
                                      {kNodeOffset, std::to_string(options.clocks.node_us)}});
}

const Outcome& LogExport::add(const LogEvent& event) {
  ++counts_.events;
  // LogReader accepts no stamp before 1970; one after the year 2262 has no nanoseconds in 64 bits.
  constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
  const std::int64_t utime = std::clamp(to_utime(event.stamp), std::int64_t{0}, kMax_us);
  time_ns_ = static_cast<std::uint64_t>(utime) * 1000U;
  switch (converter_.convert(event.channel, event.data.data(), event.data.size())) {
    case ros2::Conversion::kUnknownChannel:
      ++counts_.unknown[event.channel];
      break;
    case ros2::Conversion::kMalformed:
      ++counts_.malformed[event.channel];
      break;
    case ros2::Conversion::kDone:
      if (!has_ladar_ && event.channel == channel::kLadarRanges) {
        ++counts_.ranges_without_calibration;
      }
      break;
  }
  return writer_.outcome();
}

Outcome LogExport::finish() {
  converter_.finish();
  return writer_.finish();
}

std::vector<ExportedTopic> LogExport::topics() const {
  std::vector<ExportedTopic> out;
  for (const auto& [topic, stream] : streams_) {
    out.push_back({topic, stream.type, writer_.messages_of(stream.id)});
  }
  return out;
}

void LogExport::publish(std::string_view topic, const ros2::Schema& schema,
                        const std::vector<std::uint8_t>& cdr) {
  auto at = streams_.find(topic);
  if (at == streams_.end()) {
    const std::string name(topic);
    at = streams_.emplace(name, open(name, schema)).first;
  }
  // The number of the event: messages that were made of one event have the same.
  const auto sequence = static_cast<std::uint32_t>(counts_.events - 1);
  writer_.write(at->second.id, sequence, time_ns_, cdr.data(), cdr.size());
}

LogExport::Stream LogExport::open(const std::string& topic, const ros2::Schema& schema) {
  auto known = schemas_.find(schema.name);
  if (known == schemas_.end()) {
    known = schemas_.emplace(schema.name, writer_.add_schema(schema.name, "ros2msg", schema.text))
                .first;
  }
  // Profile ros2 requires the key; empty: the default of the player.
  TextMap metadata = {{"offered_qos_profiles", ""}};
  const std::string prefix = ros2::topic::kOriginalPrefix;
  if (topic.compare(0, prefix.size(), prefix) == 0) {
    const std::string channel = topic.substr(prefix.size());
    metadata[kLcmChannel] = channel;
    metadata[kLcmFingerprint] = fingerprint_of(channel);
  }
  return {writer_.add_channel(known->second, topic, "cdr", metadata), schema.name};
}

}  // namespace rcs::mcap
