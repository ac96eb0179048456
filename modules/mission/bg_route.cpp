#include "modules/mission/bg_route.h"

#include <algorithm>
#include <cmath>

namespace rcs::mission {

std::vector<Vec2> divided(const std::vector<Vec2>& line, double spacing_m) {
  std::vector<Vec2> out;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vec2 leg = line[k] - line[k - 1];
    const int n = std::max(1, static_cast<int>(std::ceil(leg.norm() / spacing_m)));
    for (int s = 1; s <= n; ++s) out.emplace_back(line[k - 1] + static_cast<double>(s) / n * leg);
  }
  return out;
}

}  // namespace rcs::mission
