#pragma once
// Messages of the known channels as named columns, for tables and spreadsheets.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::recording {

/// (column, value as text), in the order of the type definition. Arrays of fixed length become one
/// column per entry; of arrays of variable length (points, tiles, stages) only n is included.
using Fields = std::vector<std::pair<std::string, std::string>>;

/// `utime` and `seq`, the first fields of every type of this system.
struct MessageHead {
  std::int64_t utime = 0;
  std::int64_t seq = 0;
};

[[nodiscard]] bool known_channel(std::string_view channel);

/// nullopt if the channel is unknown or the bytes are not of its type.
[[nodiscard]] std::optional<MessageHead> read_head(std::string_view channel,
                                                   const std::uint8_t* data, std::size_t size);
[[nodiscard]] inline std::optional<MessageHead> read_head(std::string_view channel,
                                                          const std::vector<std::uint8_t>& data) {
  return read_head(channel, data.data(), data.size());
}

/// nullopt if the channel is unknown or the message cannot be decoded.
[[nodiscard]] std::optional<Fields> read_fields(std::string_view channel,
                                                const std::vector<std::uint8_t>& data);

}  // namespace rcs::recording
