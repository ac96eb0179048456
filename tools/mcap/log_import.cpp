#include "tools/mcap/log_import.h"

#include <fmt/format.h>

#include <limits>
#include <type_traits>

#include "lcmtypes/channel_types.h"
#include "rcs/cdr/cdr_message.h"
#include "rcs/ros2/converter.h"
#include "tools/mcap/log_export.h"

namespace rcs::mcap {

bool to_lcm(std::string_view channel, const std::uint8_t* cdr, std::size_t size,
            std::vector<std::uint8_t>* out) {
  bool done = false;
  channel::with_type_of(channel, [&](const auto* type) {
    std::remove_const_t<std::remove_pointer_t<decltype(type)>> message{};
    // encode() reads as many elements as the length fields state.
    if (!cdr::read_message(cdr, size, &message) || !lengths_match(message)) return;
    const int bytes = message.getEncodedSize();
    out->resize(static_cast<std::size_t>(bytes));
    done = message.encode(out->data(), 0, bytes) == bytes;
  });
  return done;
}

Result<const LogImport::Source*> LogImport::source_of(std::uint16_t channel_id) {
  if (const auto at = sources_.find(channel_id); at != sources_.end()) return &at->second;
  Source source;
  const Channel* channel = reader_.channel(channel_id);
  if (channel != nullptr) {
    source.topic = channel->topic;
    const Schema* schema = reader_.schema(channel->schema_id);
    const std::string prefix = ros2::topic::kOriginalPrefix;
    if (schema != nullptr && channel->message_encoding == "cdr" &&
        channel->topic.compare(0, prefix.size(), prefix) == 0) {
      const std::string name = channel->topic.substr(prefix.size());
      channel::with_type_of(name, [&](const auto* type) {
        using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
        if (ros2::schema_of<T>().name == schema->name) source.lcm_channel = name;
      });
      const auto stated = channel->metadata.find(kLcmFingerprint);
      if (!source.lcm_channel.empty() && stated != channel->metadata.end() &&
          stated->second != fingerprint_of(name)) {
        return Error{fmt::format(
            "{}: {} has another revision than in this program (fingerprint {}, expected {})", file_,
            schema->name, stated->second, fingerprint_of(name))};
      }
    }
  }
  return &sources_.emplace(channel_id, std::move(source)).first->second;
}

Outcome LogImport::add(const Message& message) {
  const Result<const Source*> source = source_of(message.channel_id);
  if (!source) return source.error();
  const Source& from = **source;
  if (from.lcm_channel.empty()) {
    ++counts_.skipped[from.topic];
    return Done{};
  }
  if (message.log_time_ns > std::uint64_t{std::numeric_limits<std::int64_t>::max()}) {
    ++counts_.bad_times;
    return Done{};
  }
  if (!to_lcm(from.lcm_channel, message.data, message.size, &encoded_)) {
    ++counts_.malformed;
    return Done{};
  }
  const Stamp stamp = from_utime(static_cast<std::int64_t>(message.log_time_ns / 1000U));
  return writer_.write(stamp, from.lcm_channel, encoded_.data(), encoded_.size());
}

}  // namespace rcs::mcap
