// What stands upright, such as people and vehicles: an obstacle at once, and gone when rays pass
// where it was.

#include <algorithm>
#include <cmath>

#include "modules/wm/terrain/terrain_grid.h"

namespace rcs::wm {
namespace {

constexpr int kFewestPoints = 4;  // of one scan: no mixed pixels
constexpr std::uint8_t kHold = 3;
constexpr int kGroundKnown = 4;  // scans
constexpr int kFewestRays = 1;   // that pass in one scan
constexpr double kHalf_m = 0.1;  // of a quarter
constexpr double kBeyond_m = 0.4;
constexpr double kFarthest_m = 30.0;
constexpr float kBelowTop_m = 0.1F;

}  // namespace

// Of a quarter and those around it: the edge of a body may be all that is seen of a quarter.
float TerrainGrid::lowest_around(Cell quarter) const {
  float low_m = kUnknown_m;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const TerrainCell* const cell = cells_.find({quarter.i + i, quarter.j + j});
      if (cell != nullptr) low_m = std::min(low_m, cell->low_m);
    }
  }
  return low_m;
}

// After update() of the same scan.
void TerrainGrid::note_upright(const Seen& seen) {
  TerrainCell& cell = cells_.at(seen.cell);
  if (cell.scans == 0) return;
  const float ground_m = lowest_around(seen.cell);
  cell.hit = seen.high_m > ground_m + static_cast<float>(params_.obstacle_m) ? 1 : 0;
  if (seen.high_m < ground_m + static_cast<float>(params_.upright_m)) return;
  if (cell.listed == 0) {
    if (tall_.size() == tall_.capacity()) return;
    tall_.push_back(seen.cell);
    cell.listed = 1;
    cell.ground_unknown = cell.scans < kGroundKnown ? 1 : 0;
  }
  // The top of what was here before was another one.
  cell.high_m = std::max(cell.high_m, seen.high_m);
  if (seen.points < kFewestPoints && cell.evidence <= params_.evidence) return;
  cell.upright = kHold;
  if (upright_now_.size() < upright_now_.capacity()) upright_now_.push_back(seen.cell);
}

// A ray that passes below the top of what stood in a quarter, and above the grass, shows that it
// has gone, or that it fills the quarter in part: then other rays of the same scan end in it.
void TerrainGrid::clear_passed(const Vec3& ladar) {
  std::size_t kept = 0;
  for (const Cell at : tall_) {
    TerrainCell* const cell = cells_.find(at);
    if (cell == nullptr || cell->listed == 0) continue;  // it has left the window
    tall_[kept++] = at;
    const bool hit = cell->hit != 0;
    cell->hit = 0;
    const Vec2 place = cells_.cell_m() * Vec2(at.i + 0.5, at.j + 0.5) - ladar.head<2>();
    const double away_m = place.norm();
    if (hit || away_m > kFarthest_m) continue;
    const float bottom_m = lowest_around(at) + static_cast<float>(params_.obstacle_m);
    int passed = 0;
    bool below = false;
    rays_.passing(place, kHalf_m, kBeyond_m, [&](float rise) {
      const auto z_m = static_cast<float>(ladar.z() + rise * away_m);
      const bool under = z_m < cell->low_m - kBelowTop_m;
      below = below || under;
      passed += under || (z_m > bottom_m && z_m < cell->high_m - kBelowTop_m) ? 1 : 0;
    });
    if (passed < kFewestRays) continue;
    cell->evidence = std::max(0.0F, cell->evidence - 1.0F);
    if (cell->upright > 0) --cell->upright;
    if (cell->upright > 0 || cell->evidence > 0.0F) continue;
    --kept;
    cell->listed = 0;
    cell->high_m = cell->low_m;
    // What was taken for the ground may have been the foot of what has gone.
    if (below || cell->ground_unknown != 0) *cell = TerrainCell();
  }
  tall_.resize(kept);
}

bool TerrainGrid::passed(const Vec2& p_local) const {
  const Vec2 place = p_local - ladar_.head<2>();
  const double away_m = place.norm();
  const TerrainCell* const cell = cells_.find(cells_.cell_at(p_local.x(), p_local.y()));
  if (cell == nullptr || cell->scans == 0 || away_m > kFarthest_m) return false;
  int passed = 0;
  rays_.passing(place, kHalf_m, kBeyond_m, [&](float rise) {
    passed += ladar_.z() + rise * away_m < cell->low_m + params_.upright_m ? 1 : 0;
  });
  return passed > 1;
}

}  // namespace rcs::wm
