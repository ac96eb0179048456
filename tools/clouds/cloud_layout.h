#pragma once
// Layout of files of point clouds: headers of PCD (0.7) and PLY, and lines of numbers.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::clouds {

enum class Number { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

/// Little endian, as is this computer (x86, ARM).
[[nodiscard]] double load(Number type, const std::uint8_t* at);

/// Position of the numbers in a record of the file.
struct CloudLayout {
  struct Field {
    std::string name;
    Number type = Number::kF32;
  };
  std::vector<Field> fields;
  std::int64_t records = 0;
  bool ascii = false;
  std::size_t data_at = 0;  ///< bytes of header
  int header_lines = 0;
  int rows = 0;  ///< of an organized PCD; 0: not organized
  int cols = 0;

  [[nodiscard]] std::optional<std::size_t> index(std::string_view name) const;
  /// Offset in a binary record [bytes]; for the number of fields the size of the record.
  [[nodiscard]] std::size_t offset(std::size_t index) const;
  /// Of the fields x, y and z.
  [[nodiscard]] Result<std::array<std::size_t, 3>> axes(const std::string& name) const;
};

/// @param text  begins with the header
/// @param name  for errors
[[nodiscard]] Result<CloudLayout> parse_pcd_header(std::string_view text, const std::string& name);
[[nodiscard]] Result<CloudLayout> parse_ply_header(std::string_view text, const std::string& name);

/// Removes and returns the first line, without its end.
[[nodiscard]] std::string_view next_line(std::string_view* text);

/// Numbers of a line, separated by blanks, commas or semicolons, up to a '#'; non-finite numbers as
/// printed by C become NaN.
/// @param columns  indices, counted from 0
/// @param out  same size; unchanged where the line has no such column
/// @return number of columns of the line; an error, without the file name, if one is not a number
[[nodiscard]] Result<std::size_t> parse_columns(std::string_view line,
                                                const std::vector<std::size_t>& columns,
                                                std::vector<double>* out);

}  // namespace rcs::clouds
