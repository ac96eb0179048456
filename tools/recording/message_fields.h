#pragma once
// Messages of the known channels as named columns, for tables and spreadsheets.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::recording {

/// (column, value as text), in the order of the type's definition. Arrays of fixed length become a
/// column each; those of variable length (points, tiles, stages) are told by their n only.
using Fields = std::vector<std::pair<std::string, std::string>>;

/// The `utime` and `seq` that every type of this system begins with.
struct MessageHead {
  std::int64_t utime = 0;
  std::int64_t seq = 0;
};

[[nodiscard]] bool known_channel(std::string_view channel);

/// None when the channel is not known, or the bytes are not of its type.
[[nodiscard]] std::optional<MessageHead> read_head(std::string_view channel,
                                                   const std::vector<std::uint8_t>& data);

/// None when the channel has no known type, or the message cannot be decoded.
[[nodiscard]] std::optional<Fields> read_fields(std::string_view channel,
                                                const std::vector<std::uint8_t>& data);

}  // namespace rcs::recording
