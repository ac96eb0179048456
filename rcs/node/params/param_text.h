#pragma once
// Texts of the error messages of parameters.

#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// "sp.icp.gate_m"; the key itself at the root of the file.
[[nodiscard]] std::string full_key(std::string_view table, std::string_view key);

[[nodiscard]] bool ends_with(std::string_view text, std::string_view end);

/// " (m/s)" for speed_mps; empty where the key has no unit.
[[nodiscard]] std::string unit_of(std::string_view key);

/// "; did you mean gate_m?" if a known key is similar to the given one; else empty.
[[nodiscard]] std::string suggestion(std::string_view key, const std::vector<std::string>& known);

}  // namespace rcs
