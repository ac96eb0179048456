#pragma once
// Positions in the plane from a command line or a file.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/result.h"

namespace rcs::tools {

/// Parses "X,Y" in metres; nullopt if malformed.
[[nodiscard]] std::optional<Vec2> parse_place(const std::string& text);

/// The columns x_m and y_m of a CSV file.
/// @return an error with the line of a missing value
[[nodiscard]] Result<std::vector<Vec2>> load_places(const std::string& path);

}  // namespace rcs::tools
