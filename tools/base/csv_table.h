#pragma once
// Tables of numbers as text: one header, one row per line, cells separated by commas.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::tools {

/// Empty lines and lines that begin with # are skipped. A cell that is empty, absent at the
/// end of its row, or "nan", "na", "null", "none" or infinite in any case, is missing.
class CsvTable {
 public:
  /// @param name  of the file, for messages
  /// @return an error with the line: no header, a column without a name or with a duplicate one, a
  ///         row longer than the header
  [[nodiscard]] static Result<CsvTable> parse(std::string text, std::string name);
  [[nodiscard]] static Result<CsvTable> load(const std::string& path);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::size_t rows() const { return lines_.size(); }
  /// File and line of the row for a message: "drive.csv:17".
  [[nodiscard]] std::string place(std::size_t row) const;

  /// The numbers of a column, NaN if missing.
  /// @return an error with the column, and the line of a cell that is not a number
  [[nodiscard]] Result<std::vector<double>> numbers(std::string_view column) const;

 private:
  struct Cell {
    std::size_t begin = 0;
    std::size_t size = 0;
  };

  CsvTable() = default;
  /// The cells of a line, without surrounding blanks.
  void split(std::size_t begin, std::size_t end, std::vector<Cell>* cells) const;
  [[nodiscard]] std::string_view text_of(const Cell& c) const {
    return std::string_view(text_).substr(c.begin, c.size);
  }

  std::string name_;
  std::string text_;
  std::vector<Cell> header_;
  std::vector<Cell> cells_;  ///< row by row, as many as the header has
  std::vector<int> lines_;   ///< of each row
};

}  // namespace rcs::tools
