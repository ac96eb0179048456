#pragma once
// Places in the plane as people give them: on a command line, or in a file.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/result.h"

namespace rcs::tools {

/// "X,Y" in metres; none when it is anything else.
[[nodiscard]] std::optional<Vec2> parse_place(const std::string& text);

/// The columns x_m and y_m of a CSV file.
/// @return an error that names the line of a place that is missing
[[nodiscard]] Result<std::vector<Vec2>> load_places(const std::string& path);

}  // namespace rcs::tools
