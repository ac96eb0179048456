#pragma once
// The header of LAS files, 1.2 to 1.4, by the specifications of the ASPRS ("LAS Specification",
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

  /// Formats 6 to 10 have separate bytes for classes and flags, the others shared ones.
  [[nodiscard]] bool has_wide_classes() const { return format >= 6; }
};

/// All values of the header are checked against the length of the file: the points and all records
/// of variable length are within it. Compressed files (LAZ) are rejected with a message.
/// @param in  at the begin of the file
/// @param size  of the file [bytes]
/// @param name  errors begin with it and contain the field
[[nodiscard]] Result<LasHeader> read_las_header(std::istream& in, std::int64_t size,
                                                const std::string& name);

}  // namespace rcs::clouds
