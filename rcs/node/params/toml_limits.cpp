#include "rcs/node/params/toml_limits.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs {
namespace {

/// End of the three quotes at `at` that close a string: up to two more belong to its text.
std::size_t end_of_quotes(std::string_view text, std::size_t at) {
  std::size_t end = at + 3;
  while (end < std::min(at + 5, text.size()) && text[end] == text[at]) ++end;
  return end;
}

/// End of the string that begins at `at`; a single-line string ends at the end of its line at the
/// latest.
std::size_t end_of_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const std::string triple(3, quote);
  const bool is_multi_line = text.substr(at, 3) == triple;
  for (std::size_t i = at + (is_multi_line ? 3 : 1); i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"') {
      ++i;
    } else if (is_multi_line) {
      if (text.substr(i, 3) == triple) return end_of_quotes(text, i);
    } else if (text[i] == quote) {
      return i + 1;
    } else if (text[i] == '\n') {
      return i;
    }
  }
  return text.size();
}

}  // namespace

Outcome check_toml_limits(std::string_view text, std::string_view name) {
  if (text.size() > kMaxTomlBytes) {
    return Error{fmt::format("{}: more than {} bytes", name, kMaxTomlBytes)};
  }
  const auto line_at = [&](std::size_t at) {
    return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  };
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  int dots = 0;  // since the beginning of a key or value
  const std::size_t begin = text.substr(0, 3) == kByteOrderMark ? 3 : 0;
  for (std::size_t i = begin; i < text.size();) {
    const char c = text[i];
    // toml++ 3.3 asks whether it is white space, and that function has undefined behavior.
    if (static_cast<unsigned char>(c) >= 0x80) {
      return Error{
          fmt::format("{}:{}: a character outside of ASCII, not in quotes", name, line_at(i))};
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '"' || c == '\'') {
      i = end_of_string(text, i);
      continue;
    }
    if (std::string_view("=,{}[]\n").find(c) != std::string_view::npos) dots = 0;
    if (c == '.' && ++dots > kMaxKeyDots) {
      return Error{
          fmt::format("{}:{}: a key with more than {} dots", name, line_at(i), kMaxKeyDots)};
    }
    ++i;
  }
  return Done{};
}

}  // namespace rcs
