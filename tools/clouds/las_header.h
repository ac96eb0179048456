#pragma once
// The header of LAS files, 1.2 to 1.4, as the ASPRS's specifications have it ("LAS Specification",
// versions 1.2, 2008, to 1.4-R15, 2019).

#include <array>
#include <cstdint>
#include <iosfwd>
#include <string>

#include "rcs/base/result.h"
#include "tools/clouds/survey_points.h"

namespace rcs::clouds {

struct LasHeader {
  int minor = 0;   ///< of version 1.minor: 2, 3 or 4
  int format = 0;  ///< of the points, 0 to 10
  std::int64_t data_at = 0;
  std::int64_t record_bytes = 0;
  std::int64_t points = 0;
  std::array<double, 3> scale{};
  std::array<double, 3> offset{};
  SurveyCrs crs;

  /// Formats 6 to 10 have whole bytes for classes and flags, those before share them.
  [[nodiscard]] bool has_wide_classes() const { return format >= 6; }
};

/// Nothing in the header is believed before it is bounded by the file's length: the points and all
/// records of variable length lie in the file. Compressed files (LAZ) are refused by name.
/// @param in  at the file's begin
/// @param size  of the file [bytes]
/// @param name  errors begin with it and name the field
[[nodiscard]] Result<LasHeader> read_las_header(std::istream& in, std::int64_t size,
                                                const std::string& name);

}  // namespace rcs::clouds
