#pragma once
// Messages of the WebSocket subprotocol foxglove.websocket.v1 that the viewer uses
// (github.com/foxglove/ws-protocol). Clients cannot publish: no capability offers it.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/view/server/topic_table.h"

namespace rcs::view {

inline constexpr char kFoxgloveProtocol[] = "foxglove.websocket.v1";

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

/// @param session  differs from one start of the server to the next
[[nodiscard]] std::string server_info(const std::string& name, const std::string& session);
/// The topics that are made of `channels`, with their schemas.
[[nodiscard]] std::string advertisement(const TopicTable& topics, ChannelSet channels);
[[nodiscard]] std::string status_message(StatusLevel level, const std::string& text);

/// Precedes the payload of a message in its binary frame.
[[nodiscard]] std::array<std::uint8_t, 13> message_header(std::uint32_t subscription,
                                                          std::uint64_t time_ns);

/// What a client requests.
struct ClientRequest {
  struct Subscription {
    std::uint32_t id = 0;
    std::uint32_t topic = 0;
  };
  std::vector<Subscription> subscribe;
  std::vector<std::uint32_t> unsubscribe;
  std::string problem;  ///< not empty: nothing is requested, and why
};
/// @param text  untrusted
[[nodiscard]] ClientRequest parse_request(std::string_view text);

}  // namespace rcs::view
