#pragma once
// Keys that replace those of a configuration's text.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::driving {

/// The configuration (TOML) with these keys in the table `[name]`, which is added if it is not
/// there. A key that is in the table already is replaced; the other lines stay as they are.
/// @param keys  name and value as TOML text; a replaced value must be on one line
[[nodiscard]] std::string with_keys(std::string_view text, std::string_view name,
                                    const std::vector<std::pair<std::string, std::string>>& keys);

}  // namespace rcs::driving
