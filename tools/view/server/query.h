#pragma once
// The query of a request target.

#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>

namespace rcs::view {

/// "/api/why" of "/api/why?t=1".
[[nodiscard]] inline std::string_view path_of(std::string_view target) {
  return target.substr(0, target.find('?'));
}

[[nodiscard]] inline std::string_view query_of(std::string_view target) {
  const std::size_t at = target.find('?');
  return at == std::string_view::npos ? std::string_view() : target.substr(at + 1);
}

/// The finite number of "name=NUMBER"; nullopt: it is missing or not a number.
[[nodiscard]] inline std::optional<double> number_of(std::string_view query,
                                                     std::string_view name) {
  while (!query.empty()) {
    const std::string_view entry = query.substr(0, query.find('&'));
    query.remove_prefix(entry.size() < query.size() ? entry.size() + 1 : query.size());
    const std::size_t equals = entry.find('=');
    if (equals == std::string_view::npos || entry.substr(0, equals) != name) continue;
    const std::string_view text = entry.substr(equals + 1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace rcs::view
