#include "modules/mission/bg_route.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

std::size_t first_ahead(const Vec2& start, const std::vector<Vec2>& places, std::size_t last,
                        const Vec2& here) {
  double nearest_m = std::numeric_limits<double>::infinity();
  std::size_t first = 0;
  for (std::size_t k = 0; k < places.size() && k <= last; ++k) {
    const Vec2& from = k == 0 ? start : places[k - 1];
    const Vec2 leg = places[k] - from;
    const double t = (here - from).dot(leg) / std::max(1e-9, leg.squaredNorm());
    const double off_m = (here - from - std::clamp(t, 0.0, 1.0) * leg).norm();
    if (off_m >= nearest_m) continue;
    nearest_m = off_m;
    // Beyond the end of a part, that place is behind the vehicle, too.
    first = t >= 1.0 && k < last && k + 1 < places.size() ? k + 1 : k;
  }
  return first;
}

}  // namespace rcs::mission
