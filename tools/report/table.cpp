#include "tools/report/table.h"

#include <fmt/format.h>

#include <algorithm>

#include "rcs/base/text.h"

namespace rcs::report {
namespace {

constexpr std::size_t kGap = 2;

using Cells = std::vector<std::string>;

/// The text broken between words into lines of at most `width`; a longer word is a line.
std::vector<std::string> lines_of(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  if (text.size() <= width) return {std::string(text)};
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    if (!lines.empty() && lines.back().size() + 1 + word.size() <= width) {
      lines.back().append(" ").append(word);
    } else {
      lines.emplace_back(word);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::size_t longest_word(std::string_view text) {
  std::size_t longest = 0;
  for (const std::string& word : lines_of(text, 0)) longest = std::max(longest, word.size());
  return longest;
}

/// Widths of the columns: as wide as their widest cell, or narrower until the table fits, first
/// where only the header is wide, then the widest column.
std::vector<std::size_t> widths_of(const Table& table) {
  const std::size_t n = table.header.size();
  std::vector<std::size_t> width(n);
  std::vector<std::size_t> by_cells(n);
  std::vector<std::size_t> least(n);
  for (std::size_t c = 0; c < n; ++c) {
    least[c] = longest_word(table.header[c]);
    for (const Cells& row : table.rows) {
      by_cells[c] = std::max(by_cells[c], row[c].size());
      least[c] = std::max(least[c], longest_word(row[c]));
    }
    by_cells[c] = std::max(by_cells[c], longest_word(table.header[c]));
    width[c] = std::max(by_cells[c], table.header[c].size());
  }
  const auto too_wide = [&] {
    std::size_t all = n == 0 ? 0 : kGap * (n - 1);
    for (const std::size_t w : width) all += w;
    return all > kTextColumns;
  };
  for (const std::vector<std::size_t>& limit : {by_cells, least}) {
    while (too_wide()) {
      std::size_t widest = n;
      for (std::size_t c = 0; c < n; ++c) {
        if (width[c] > limit[c] && (widest == n || width[c] > width[widest])) widest = c;
      }
      if (widest == n) break;
      --width[widest];
    }
  }
  return width;
}

/// @param at_bottom  cells with fewer lines are moved down
/// @param left       all cells are left-aligned, not only the first
std::string row_text(const Cells& cells, const std::vector<std::size_t>& width, bool at_bottom,
                     bool left) {
  std::vector<std::vector<std::string>> columns;
  std::size_t height = 1;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    columns.push_back(lines_of(cells[c], width[c]));
    height = std::max(height, columns.back().size());
  }
  std::string text;
  for (std::size_t k = 0; k < height; ++k) {
    std::string line;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::size_t above = at_bottom ? height - columns[c].size() : 0;
      const bool has = k >= above && k - above < columns[c].size();
      const std::string cell = has ? columns[c][k - above] : std::string();
      line += std::string(c == 0 ? 0 : kGap, ' ');
      line += c == 0 || left ? fmt::format("{:<{}}", cell, width[c])
                             : fmt::format("{:>{}}", cell, width[c]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace

std::string to_text(const Table& table) {
  const std::vector<std::size_t> width = widths_of(table);
  std::string text = row_text(table.header, width, true, table.left);
  for (const Cells& row : table.rows) text += row_text(row, width, false, table.left);
  if (!table.note.empty()) text += "(" + wrapped(table.note, 1) + ")\n";
  return text;
}

std::string fixed(double v, int digits) { return fmt::format("{:.{}f}", v, digits); }

}  // namespace rcs::report
