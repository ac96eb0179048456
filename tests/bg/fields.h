#pragma once
// Synthetic ground for BG's tests.

#include <functional>

#include "modules/bg/hidden_ground.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg::test {

/// Level, smooth and known, except for the cells for whose middle `blocked` returns true.
inline vj::Terrain level_field(int side,
                               const std::function<bool(double x_m, double y_m)>& blocked) {
  vj::Terrain t;
  t.cell_m = 0.4;
  t.first = {-side / 2, -side / 2};
  t.width = side;
  t.height = side;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      vj::Ground g;
      g.known = true;
      g.obstacle = blocked((t.first.i + i + 0.5) * t.cell_m, (t.first.j + j + 0.5) * t.cell_m);
      g.step_m = g.obstacle ? 1.0F : 0.0F;
      t.ground.push_back(g);
    }
  }
  return t;
}

/// A LADAR whose rows meet the ground closer than a cell up to 9 m.
inline SightParams sight() {
  SightParams params;
  params.far_m = 9.0;
  return params;
}

}  // namespace rcs::bg::test
