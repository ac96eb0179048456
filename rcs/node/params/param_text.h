#pragma once
// Texts of the error messages of parameters.

#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// " (m/s)" for speed_mps; empty where the key has no unit.
[[nodiscard]] std::string unit_of(std::string_view key);

/// "; did you mean gate_m?" if a known key is similar to the given one; else empty.
[[nodiscard]] std::string suggestion(std::string_view key, const std::vector<std::string>& known);

}  // namespace rcs
