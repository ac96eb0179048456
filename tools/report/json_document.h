#pragma once
// The JSON documents of the commands: docs/reference/json has a schema for each.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace rcs::report {

using Json = nlohmann::ordered_json;

/// "rcs.map.info/1" for "map info". The number increases when a key is renamed or removed.
[[nodiscard]] std::string schema_name(std::string_view command);

/// The numbers rounded to what they mean: 6 significant digits, and at least 4 decimals; 9 and 9
/// for positions in degrees, transforms and information matrices.
[[nodiscard]] Json rounded(Json value);

/// The document of a command as text, with a line end.
/// @param content  an object; "schema" becomes its first key, and its numbers are rounded
[[nodiscard]] std::string json_document(std::string_view command, const Json& content);

}  // namespace rcs::report
