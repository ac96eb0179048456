#pragma once
// A LADAR, or its driver, that repeats a scan with new stamps. Ranges have noise: equal points are
// no new measurement, and would be registered as if the vehicle stood still.

#include <cstddef>
#include <cstdint>

#include "rcs/base/points.h"

namespace rcs::sp {

class ScanRepetition {
 public:
  /// @param points  of the next scan, as converted from its facets
  /// @return they are those of the scan before, to the bit
  [[nodiscard]] bool repeats(const Points& points);

 private:
  std::size_t points_ = 0;  // of the scan before
  std::uint64_t hash_ = 0;
};

}  // namespace rcs::sp
