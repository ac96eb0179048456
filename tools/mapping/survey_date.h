#pragma once
// Dates in maps: days since 2000-01-01.

#include <string>

namespace rcs::mapping {

/// Parses "2019-06-30" to days since 2000-01-01; 0: invalid.
[[nodiscard]] int parse_date(const std::string& text);

/// "unknown" for 0.
[[nodiscard]] std::string date_text(int days);

}  // namespace rcs::mapping
