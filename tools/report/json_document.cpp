#include "tools/report/json_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace rcs::report {
namespace {

struct Precision {
  int significant;  ///< digits
  int decimals;     ///< at least, even if there are more significant digits then
};
constexpr Precision kUsual = {6, 4};
constexpr Precision kPosition = {9, 8};
constexpr Precision kInformation = {9, -20};  // no digits after the significant ones

/// Commands whose documents have version 2; the others have version 1.
constexpr std::string_view kVersion2[] = {"budget", "map locate"};

/// Of the value of a key; `usual` for most keys.
const Precision& precision_of(std::string_view key, const Precision& usual) {
  if (key == "information") return kInformation;
  constexpr std::string_view kPositions[] = {"lat_deg", "lon_deg", "T_model_data", "pose_tum"};
  const bool position =
      std::find(std::begin(kPositions), std::end(kPositions), key) != std::end(kPositions);
  return position ? kPosition : usual;
}

/// The shortest text of the rounded number. (That of nlohmann is not always the shortest.)
std::string number_text(double v, const Precision& precision) {
  if (!std::isfinite(v)) return "null";
  if (v == 0.0) return "0.0";
  const int before_point = static_cast<int>(std::floor(std::log10(std::abs(v)))) + 1;
  const int digits = std::max(precision.significant, before_point + precision.decimals);
  const std::string exact = fmt::format("{:.{}e}", v, std::clamp(digits, 1, 16) - 1);
  const std::string text = fmt::format("{}", std::strtod(exact.c_str(), nullptr));
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string key_text(const std::string& key) {
  return Json(key).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void append(const Json& value, const Precision& precision, const std::string& line_end,
            std::string* text) {
  if (!value.is_structured()) {
    *text += value.is_number_float() ? number_text(value.get<double>(), precision)
                                     : value.dump(-1, ' ', false, Json::error_handler_t::replace);
    return;
  }
  if (value.empty()) {
    *text += value.is_array() ? "[]" : "{}";
    return;
  }
  const std::string inner = line_end + "  ";
  std::string separator = value.is_array() ? "[" : "{";
  for (const auto& [key, entry] : value.items()) {
    *text += separator + inner;
    separator = ",";
    if (value.is_object()) *text += key_text(key) + ": ";
    append(entry, value.is_object() ? precision_of(key, precision) : precision, inner, text);
  }
  *text += line_end + (value.is_array() ? "]" : "}");
}

}  // namespace

std::string schema_name(std::string_view command) {
  const bool second =
      std::find(std::begin(kVersion2), std::end(kVersion2), command) != std::end(kVersion2);
  std::string name = fmt::format("rcs.{}/{}", command, second ? 2 : 1);
  std::replace(name.begin(), name.end(), ' ', '.');
  return name;
}

std::string json_document(std::string_view command, const Json& content) {
  Json document = {{"schema", schema_name(command)}};
  document.update(content);
  std::string text;
  append(document, kUsual, "\n", &text);
  return text + "\n";
}

}  // namespace rcs::report
