#include "rcs/node/params/param_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace rcs {
namespace {

/// Levenshtein's distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replace});
    }
  }
  return row[b.size()];
}

}  // namespace

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

std::string suggestion(std::string_view key, const std::vector<std::string>& known) {
  const std::string* best = nullptr;
  // Not every letter may be another one.
  std::size_t best_distance = std::min(std::max<std::size_t>(2, key.size() / 3) + 1, key.size());
  for (const std::string& k : known) {
    const std::size_t distance = edit_distance(key, k);
    if (distance < best_distance) {
      best = &k;
      best_distance = distance;
    }
  }
  return best == nullptr ? "" : fmt::format("; did you mean {}?", *best);
}

}  // namespace rcs
