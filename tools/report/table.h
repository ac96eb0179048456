#pragma once
// A table of values for a terminal or a page.

#include <string>
#include <vector>

namespace rcs::report {

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< as wide as the header
};

/// Columns padded to their widest cell; the first left-aligned, the others to the right.
[[nodiscard]] std::string to_text(const Table& table);

}  // namespace rcs::report
