#pragma once
// A table of values for a terminal or a page.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace rcs::report {

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< as wide as the header
  std::string note{};  ///< explains marks and abbreviations; below the table
  bool left = false;   ///< all columns left-aligned: a table of words
};

/// Columns padded to their widest cell; the first left-aligned, the others to the right. A table of
/// more than 100 columns is made narrower by breaking headers and cells between words.
[[nodiscard]] std::string to_text(const Table& table);

/// @return v with so many decimals
[[nodiscard]] std::string fixed(double v, int digits);

}  // namespace rcs::report
