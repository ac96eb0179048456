#include "tools/driving/config_table.h"

#include <algorithm>

namespace rcs::driving {
namespace {

std::string_view trimmed(std::string_view s) {
  constexpr std::string_view kSpace = " \t\r";
  const std::size_t first = s.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return s.substr(first, s.find_last_not_of(kSpace) - first + 1);
}

/// The name of the table that this line begins; empty: none.
std::string_view table_of(std::string_view line) {
  const std::string_view content = trimmed(line.substr(0, line.find('#')));
  if (content.size() < 2 || content.front() != '[' || content.back() != ']') return {};
  return trimmed(content.substr(1, content.size() - 2));
}

}  // namespace

std::string with_keys(std::string_view text, std::string_view name,
                      const std::vector<std::pair<std::string, std::string>>& keys) {
  std::string added;
  for (const auto& [key, value] : keys) added.append(key).append(" = ").append(value).append("\n");
  const auto replaced = [&keys](std::string_view line) {
    const std::string_view key = trimmed(line.substr(0, line.find('=')));
    return line.find('=') != std::string_view::npos &&
           std::any_of(keys.begin(), keys.end(), [key](const auto& k) { return k.first == key; });
  };
  std::string out;
  bool there = false;
  bool inside = false;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    const std::string_view content = line.back() == '\n' ? line.substr(0, end) : line;
    if (!trimmed(content).empty() && trimmed(content).front() == '[') {
      inside = table_of(content) == name;
    } else if (inside && replaced(content)) {
      continue;
    }
    out += content;
    out += '\n';
    if (inside && table_of(content) == name) {
      out += added;
      there = true;
    }
  }
  if (!there) out += "\n[" + std::string(name) + "]\n" + added;
  return out;
}

}  // namespace rcs::driving
