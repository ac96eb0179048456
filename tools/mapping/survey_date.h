#pragma once
// Days as maps count them: since 2000-01-01.

#include <string>

namespace rcs::mapping {

/// "2019-06-30" in days since 2000-01-01; 0: no date that can be told.
[[nodiscard]] int parse_date(const std::string& text);

/// "unknown" for 0.
[[nodiscard]] std::string date_text(int days);

}  // namespace rcs::mapping
