#include "tools/view/server/foxglove_protocol.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "rcs/base/byte_codec.h"

namespace rcs::view {
namespace {

using Json = nlohmann::ordered_json;

enum BinaryOperation : std::uint8_t { kMessageData = 1 };

/// Bytes that are not UTF-8 are replaced: nothing throws.
std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<std::uint32_t> id_of(const Json& json) {
  if (!json.is_number_unsigned()) return std::nullopt;
  const auto value = json.get<std::uint64_t>();
  if (value > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

/// nullptr: there is none.
const Json* member(const Json& json, const char* name) {
  if (!json.is_object()) return nullptr;
  const auto at = json.find(name);
  return at == json.end() ? nullptr : &*at;
}

std::optional<std::uint32_t> member_id(const Json& json, const char* name) {
  const Json* value = member(json, name);
  return value == nullptr ? std::nullopt : id_of(*value);
}

ClientRequest refused(std::string problem) {
  ClientRequest request;
  request.problem = std::move(problem);
  return request;
}

}  // namespace

std::string server_info(const std::string& name, const std::string& session) {
  return text_of({{"op", "serverInfo"},
                  {"name", name},
                  {"capabilities", Json::array()},
                  {"supportedEncodings", Json::array({"cdr"})},
                  {"metadata", Json::object()},
                  {"sessionId", session}});
}

std::string advertisement(const TopicTable& topics, ChannelSet channels) {
  Json list = Json::array();
  for (const TopicInfo& topic : topics.topics()) {
    if ((topic.sources & channels) == 0) continue;
    list.push_back({{"id", topic.id},
                    {"topic", topic.name},
                    {"encoding", "cdr"},
                    {"schemaName", topic.schema->name},
                    {"schema", topic.schema->text},
                    {"schemaEncoding", "ros2msg"}});
  }
  return text_of({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string status_message(StatusLevel level, const std::string& text) {
  return text_of({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", text}});
}

std::array<std::uint8_t, 13> message_header(std::uint32_t subscription, std::uint64_t time_ns) {
  std::array<std::uint8_t, 13> header{};
  header[0] = kMessageData;
  wire::put(subscription, header.data() + 1);
  wire::put(time_ns, header.data() + 5);
  return header;
}

ClientRequest parse_request(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  const Json* op = member(json, "op");
  if (op == nullptr || !op->is_string()) return refused("not a JSON object with a text \"op\"");
  const auto& name = op->get_ref<const std::string&>();
  ClientRequest request;
  if (name == "subscribe") {
    const Json* list = member(json, "subscriptions");
    if (list == nullptr || !list->is_array()) return refused("subscribe without \"subscriptions\"");
    for (const Json& entry : *list) {
      const auto id = member_id(entry, "id");
      const auto topic = member_id(entry, "channelId");
      if (!id || !topic) return refused("subscribe: a subscription needs \"id\" and \"channelId\"");
      request.subscribe.push_back({*id, *topic});
    }
  } else if (name == "unsubscribe") {
    const Json* list = member(json, "subscriptionIds");
    if (list == nullptr || !list->is_array()) {
      return refused("unsubscribe without \"subscriptionIds\"");
    }
    for (const Json& entry : *list) {
      const auto id = id_of(entry);
      if (!id) return refused("unsubscribe: an id is not an unsigned number of 32 bits");
      request.unsubscribe.push_back(*id);
    }
  } else {
    return refused("operation \"" + name.substr(0, 40) +
                   "\" is not offered: clients of the viewer receive only");
  }
  return request;
}

}  // namespace rcs::view
