#include "tools/report/table.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::report {

std::string to_text(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < table.header.size(); ++c) {
    widths.push_back(table.header[c].size());
    for (const std::vector<std::string>& row : table.rows) {
      widths[c] = std::max(widths[c], row[c].size());
    }
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      text += c == 0 ? fmt::format("{:<{}}", cells[c], widths[c])
                     : fmt::format("  {:>{}}", cells[c], widths[c]);
    }
    return text + "\n";
  };
  std::string text = line(table.header);
  for (const std::vector<std::string>& row : table.rows) text += line(row);
  return text;
}

}  // namespace rcs::report
