#pragma once
// How clouds in files of others are laid out: the headers of PCD (0.7) and PLY, and lines of
// numbers.

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

/// Where a record of the file has its numbers.
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
  /// In a binary record [bytes]; of the number of fields: the record's size.
  [[nodiscard]] std::size_t offset(std::size_t index) const;
  /// Of the fields x, y and z.
  [[nodiscard]] Result<std::array<std::size_t, 3>> axes(const std::string& name) const;
};

/// @param text  begins with the header
/// @param name  for errors
[[nodiscard]] Result<CloudLayout> parse_pcd_header(std::string_view text, const std::string& name);
[[nodiscard]] Result<CloudLayout> parse_ply_header(std::string_view text, const std::string& name);

/// Takes the first line off, without its end.
[[nodiscard]] std::string_view next_line(std::string_view* text);

/// Numbers of a line, between blanks, commas or semicolons, up to a '#'; what C writes for numbers
/// that are none is NaN.
/// @param columns  which, counted from 0
/// @param out  as many; untouched where the line has no such column
/// @return how many columns the line has; an error, without the file's name, at what is no number
[[nodiscard]] Result<std::size_t> parse_columns(std::string_view line,
                                                const std::vector<std::size_t>& columns,
                                                std::vector<double>* out);

}  // namespace rcs::clouds
