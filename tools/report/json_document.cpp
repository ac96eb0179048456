#include "tools/report/json_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace rcs::report {
namespace {

struct Precision {
  int significant;  ///< digits
  int decimals;     ///< of large values
};
constexpr Precision kUsual = {6, 4};
constexpr Precision kExact = {9, 9};

bool is_exact(std::string_view key) {
  constexpr std::string_view kKeys[] = {"lat_deg", "lon_deg", "T_model_data", "pose_tum",
                                        "information"};
  return std::find(std::begin(kKeys), std::end(kKeys), key) != std::end(kKeys);
}

double rounded(double v, const Precision& precision) {
  if (v == 0.0 || !std::isfinite(v)) return v;
  const int before_point = static_cast<int>(std::floor(std::log10(std::abs(v)))) + 1;
  const int digits = std::max(precision.significant, before_point + precision.decimals);
  const std::string text = fmt::format("{:.{}e}", v, std::clamp(digits, 1, 16) - 1);
  return std::strtod(text.c_str(), nullptr) + 0.0;  // no -0.0
}

void round_all(const Precision& precision, Json* value) {
  if (value->is_number_float()) *value = rounded(value->get<double>(), precision);
  if (value->is_array()) {
    for (Json& entry : *value) round_all(precision, &entry);
  }
  if (value->is_object()) {
    for (auto& [key, entry] : value->items()) {
      round_all(is_exact(key) ? kExact : precision, &entry);
    }
  }
}

}  // namespace

std::string schema_name(std::string_view command) {
  std::string name = fmt::format("rcs.{}/1", command);
  std::replace(name.begin(), name.end(), ' ', '.');
  return name;
}

Json rounded(Json value) {
  round_all(kUsual, &value);
  return value;
}

std::string json_document(std::string_view command, const Json& content) {
  Json document = {{"schema", schema_name(command)}};
  document.update(rounded(content));
  return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace rcs::report
