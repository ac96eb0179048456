#pragma once
// The JSON documents of the commands: docs/reference/json has a schema for each.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace rcs::report {

using Json = nlohmann::ordered_json;

/// "rcs.map.info/1" for "map info". The number increases when a key is renamed or removed.
[[nodiscard]] std::string schema_name(std::string_view command);

/// The document of a command as text, with a line end. Numbers are rounded to 6 significant digits,
/// and at least 4 decimals; latitudes, longitudes and transforms to 9 and 8, information matrices
/// to 9 significant digits.
/// @param content  an object; "schema" becomes its first key
[[nodiscard]] std::string json_document(std::string_view command, const Json& content);

}  // namespace rcs::report
