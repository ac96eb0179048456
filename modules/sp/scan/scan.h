#pragma once
// One LADAR scan while SP processes it.

#include <cstdint>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/stamp.h"

namespace rcs::sp {

/// Points in the vehicle frame [m]. Converted from a facet, each is valid at its own time,
/// reference + dt_us; deskew() moves all to the reference instant.
struct Scan {
  Stamp reference;
  Points points;
  std::vector<std::int32_t> dt_us;  ///< one for each point

  void clear() {
    points.clear();
    dt_us.clear();
  }
  void reserve(std::size_t n) {
    points.reserve(n);
    dt_us.reserve(n);
  }
};

}  // namespace rcs::sp
