#pragma once
// The sides of obstacles.

#include <cstddef>
#include <vector>

#include "modules/wm/terrain/terrain_grid.h"

namespace rcs::wm {

/// The side of a rock is too low to be an obstacle by itself, but a vehicle that passes the rock
/// within its margin touches it. Cells that are higher than `side_m` and next to an obstacle, or
/// next to such a cell, become obstacles. Ground that an edge hides has no sides.
/// @param width  cells of a row of `answers`
inline void join_sides(int width, double side_m, std::vector<TerrainAnswer>* answers) {
  constexpr int kRounds = 2;  // 0.8 m: the radius of a rock
  if (side_m <= 0.0 || width <= 0) return;
  const int height = static_cast<int>(answers->size()) / width;
  const auto at = [&](int i, int j) -> TerrainAnswer& {
    return (*answers)[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(i)];
  };
  for (int round = 0; round < kRounds; ++round) {
    for (int j = 1; j + 1 < height; ++j) {
      for (int i = 1; i + 1 < width; ++i) {
        TerrainAnswer& a = at(i, j);
        if (!a.known || a.obstacle || a.vegetation || a.low_m < static_cast<float>(side_m)) {
          continue;
        }
        for (int k = 0; k < 9 && !a.side; ++k) {
          const TerrainAnswer& other = at(i + k % 3 - 1, j + k / 3 - 1);
          a.side = other.obstacle && !other.hidden;
        }
      }
    }
    for (TerrainAnswer& a : *answers) {
      if (a.side) a.cause = ObstacleCause::kSide;
      a.obstacle = a.obstacle || a.side;
      a.side = false;
    }
  }
}

}  // namespace rcs::wm
