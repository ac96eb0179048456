#pragma once
// Texts of the error messages of parameters.

#include <string>
#include <string_view>

namespace rcs {

/// "sp.icp.gate_m"; the key itself at the root of the file.
[[nodiscard]] std::string full_key(std::string_view table, std::string_view key);

[[nodiscard]] bool ends_with(std::string_view text, std::string_view end);

/// " (m/s)" for speed_mps; empty where the key has no unit.
[[nodiscard]] std::string unit_of(std::string_view key);

}  // namespace rcs
