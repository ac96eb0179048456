#include "tools/base/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/base/files.h"

namespace rcs::tools {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

bool says_missing(std::string_view cell) {
  constexpr std::array<std::string_view, 4> kWords = {"", "na", "null", "none"};
  std::string lower;
  for (const char c : cell) {
    lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return std::find(kWords.begin(), kWords.end(), lower) != kWords.end();
}

/// NaN: missing. nullopt: not a number.
std::optional<double> number_of(std::string_view cell) {
  if (says_missing(cell)) return kMissing;
  if (cell.front() == '+') cell.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (end != cell.data() + cell.size()) return std::nullopt;
  if (error == std::errc::result_out_of_range) return kMissing;
  if (error != std::errc()) return std::nullopt;
  return std::isfinite(value) ? value : kMissing;
}

/// A cell with arbitrary content, sanitized for a message.
std::string shown(std::string_view cell) {
  constexpr std::size_t kMax = 40;
  std::string text;
  for (const char c : cell.substr(0, kMax)) {
    text += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  }
  return cell.size() > kMax ? text + "..." : text;
}

}  // namespace

Result<CsvTable> CsvTable::load(const std::string& path) {
  Result<std::string> text = read_text(path);
  if (!text) return text.error();
  return parse(std::move(text).value(), path);
}

Result<CsvTable> CsvTable::parse(std::string text, std::string name) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  CsvTable t;
  t.name_ = std::move(name);
  t.text_ = std::move(text);
  const std::string_view all = t.text_;
  std::size_t begin = all.substr(0, 3) == kByteOrderMark ? 3 : 0;
  std::vector<Cell> row;
  for (int line = 1; begin < all.size(); ++line) {
    const std::size_t end = std::min(all.find('\n', begin), all.size());
    t.split(begin, end, &row);
    begin = end + 1;
    const std::string_view first = t.text_of(row.front());
    if ((row.size() == 1 && first.empty()) || (!first.empty() && first.front() == '#')) continue;
    if (t.header_.empty()) {
      for (const Cell& c : row) {
        const std::string_view column = t.text_of(c);
        if (column.empty()) {
          return Error{
              fmt::format("{}:{}: column {} has no name", t.name_, line, &c - row.data() + 1)};
        }
        for (const Cell& before : t.header_) {
          if (t.text_of(before) != column) continue;
          return Error{
              fmt::format("{}:{}: two columns are named '{}'", t.name_, line, shown(column))};
        }
        t.header_.push_back(c);
      }
      continue;
    }
    if (row.size() > t.header_.size()) {
      return Error{fmt::format("{}:{}: {} cells, but the header names {} columns", t.name_, line,
                               row.size(), t.header_.size())};
    }
    row.resize(t.header_.size());
    t.cells_.insert(t.cells_.end(), row.begin(), row.end());
    t.lines_.push_back(line);
  }
  if (t.header_.empty()) return Error{t.name_ + ": no header: the first line names the columns"};
  return t;
}

void CsvTable::split(std::size_t begin, std::size_t end, std::vector<Cell>* cells) const {
  const auto blank = [this](std::size_t i) {
    return text_[i] == ' ' || text_[i] == '\t' || text_[i] == '\r';
  };
  cells->clear();
  while (true) {
    const std::size_t comma = std::min(text_.find(',', begin), end);
    std::size_t from = begin;
    std::size_t to = comma;
    while (from < to && blank(from)) ++from;
    while (to > from && blank(to - 1)) --to;
    cells->push_back({from, to - from});
    if (comma == end) return;
    begin = comma + 1;
  }
}

std::string CsvTable::place(std::size_t row) const {
  return fmt::format("{}:{}", name_, lines_[row]);
}

Result<std::vector<double>> CsvTable::numbers(std::string_view column) const {
  std::string known;
  for (std::size_t k = 0; k < header_.size(); ++k) {
    const std::string_view name = text_of(header_[k]);
    if (name != column) {
      known += (known.empty() ? "" : ", ") + shown(name);
      continue;
    }
    std::vector<double> values;
    values.reserve(rows());
    for (std::size_t row = 0; row < rows(); ++row) {
      const std::string_view cell = text_of(cells_[row * header_.size() + k]);
      const std::optional<double> value = number_of(cell);
      if (!value) {
        return Error{
            fmt::format("{}: column '{}': '{}' is not a number", place(row), column, shown(cell))};
      }
      values.push_back(*value);
    }
    return values;
  }
  return Error{fmt::format("{}: no column '{}'; columns: {}", name_, column, known)};
}

}  // namespace rcs::tools
