#pragma once
// Limits on a TOML text, checked before it is parsed.

#include <cstddef>
#include <string>
#include <string_view>

#include "rcs/base/result.h"

namespace rcs {

constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20;
/// Dots of one key: each nests a table in another, and tables are freed by recursion.
constexpr int kMaxKeyDots = 16;

/// An error, with `name` and line, if the text exceeds a limit above.
[[nodiscard]] Outcome check_toml_limits(std::string_view text, std::string_view name);

}  // namespace rcs
