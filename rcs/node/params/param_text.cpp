#include "rcs/node/params/param_text.h"

#include <fmt/format.h>

#include <array>

namespace rcs {

std::string full_key(std::string_view table, std::string_view key) {
  return table.empty() ? std::string(key) : fmt::format("{}.{}", table, key);
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

std::string unit_of(std::string_view key) {
  constexpr std::array<std::array<std::string_view, 2>, 19> kUnits{{
      {"_kbytes_per_s", "kB/s"},
      {"_kbytes", "kB"},
      {"_radps", "rad/s"},
      {"_degps", "deg/s"},
      {"_mps2", "m/s^2"},
      {"_mps", "m/s"},
      {"_1pm", "1/m"},
      {"_ppm", "ppm"},
      {"_kmph", "km/h"},
      {"_deg", "deg"},
      {"_rad", "rad"},
      {"_hz", "Hz"},
      {"_ms", "ms"},
      {"_us", "us"},
      {"_ns", "ns"},
      {"_cm", "cm"},
      {"_km", "km"},
      {"_m", "m"},
      {"_s", "s"},
  }};
  for (const auto& [suffix, unit] : kUnits) {
    if (ends_with(key, suffix)) return fmt::format(" ({})", unit);
  }
  return "";
}

}  // namespace rcs
