#pragma once
// A digital elevation model in ESRI ASCII grid form.

#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::sim {

/// Heights [m] on a lattice of cell centres, south-western cell first. Unknown cells are filled
/// with the mean of the known ones. Geographic grids are converted to metres at their middle
/// latitude.
struct Dem {
  int width = 0;
  int height = 0;
  double cell_x_m = 0.0;
  double cell_y_m = 0.0;
  std::vector<float> z_m;
};

/// Parses an ESRI ASCII grid; `name` is for error messages.
[[nodiscard]] Result<Dem> parse_esri_ascii(std::string_view text, const std::string& name);

}  // namespace rcs::sim
