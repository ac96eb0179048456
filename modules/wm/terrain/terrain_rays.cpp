// What the rays of a scan show besides the points at which they end: ground that an edge hides, and
// vegetation that they pass through.

#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/wm/terrain/terrain_grid.h"

namespace rcs::wm {
namespace {

constexpr std::uint8_t kHiddenMost = 12;
constexpr double kStanding_m = 0.2;  // above the ground: not the ground itself
constexpr double kThroughReach_m =
    2.4;  // before a point: farther away a ray is above the vegetation
constexpr float kBelowTop_m = 0.05F;
constexpr double kNear_m = 9.0;  // rays from nearer reach the ground between plants

// Counts a ray; old ones lose weight.
void count(std::uint8_t* which, bool near, TerrainCell* cell) {
  if (near && cell->near < 255) ++cell->near;
  if (++*which < 250) return;
  cell->stopped /= 2;
  cell->passed /= 2;
}

}  // namespace

// What an edge hides from the LADAR before a place that it sees.
void TerrainGrid::look_before(const Seen& seen, const Vec2& ladar) {
  const double step_m = cells_.cell_m();
  const Vec2 from((seen.cell.i + 0.5) * step_m, (seen.cell.j + 0.5) * step_m);
  const double away_m = (ladar - from).norm();
  const bool far = away_m > params_.edge_range_m + params_.edge.longest_m;
  if (!seen.ground || far || away_m < step_m) return;
  const Vec2 step = step_m / away_m * (ladar - from);
  const auto cell_before = [&](int k) -> TerrainCell* {
    const Vec2 p = from + k * step;
    return cells_.find(cells_.cell_at(p.x(), p.y()));
  };
  const HiddenGap gap = hidden_gap(
      [&](int k) {
        const TerrainCell* const cell = k * step_m < away_m ? cell_before(k) : nullptr;
        // Errors of scans at longer range assign ground to a ditch. Where something stands upright,
        // its foot may be taken for the ground.
        const bool seen_now = cell != nullptr && (seen.accurate ? cell->accurate : cell->scans) > 0;
        const bool known = seen_now && cell->ground_seen && cell->upright == 0;
        return known ? cell->low_m : std::numeric_limits<float>::quiet_NaN();
      },
      step_m, params_.edge);
  if (away_m - (gap.cells + 1) * step_m > params_.edge_range_m) return;
  for (int k = 1; k <= gap.cells; ++k) {
    TerrainCell& cell = *cell_before(k);
    if (gap.hidden) {
      const int looks = cell.hidden + (gap.clearly ? 2 : 1);
      cell.hidden = static_cast<std::uint8_t>(std::min<int>(kHiddenMost, looks));
    } else if (cell.hidden > 0) {
      --cell.hidden;
    }
  }
}

// Counts the ray in what stands where it ends, and in what it passes through before.
void TerrainGrid::look_through(const Vec3& hit, const Vec3& ladar) {
  const auto max_m = params_.vegetation_m + kStanding_m;
  TerrainCell* const at = cells_.find(cells_.cell_at(hit.x(), hit.y()));
  if (at == nullptr) return;
  const Vec3 way = ladar - hit;
  const double level_m = way.head<2>().norm();
  const bool near = level_m < kNear_m;
  if (at->scans > 0) {
    const double above_m = hit.z() - at->low_m;
    if (above_m > kStanding_m && above_m < max_m) count(&at->stopped, near, at);
  }
  if (level_m <= cells_.cell_m()) return;
  const Vec3 step = cells_.cell_m() / level_m * way;
  const int steps = static_cast<int>(std::min(kThroughReach_m, level_m) / cells_.cell_m());
  Vec3 p = hit;
  for (int k = 1; k <= steps; ++k) {
    p += step;
    TerrainCell* const cell = cells_.find(cells_.cell_at(p.x(), p.y()));
    if (cell == nullptr) return;
    if (cell->scans == 0) continue;
    const double above_m = p.z() - cell->low_m;
    if (above_m > max_m) return;
    if (p.z() >= cell->high_m - kBelowTop_m) continue;
    count(&cell->passed, near, cell);
    cell->pass_low_m = std::min(cell->pass_low_m, static_cast<float>(p.z()));
  }
}

// The face of a wall or a rock divides a cell, which rays along it pass: but beside it are cells
// that nothing passes, or that nobody sees.
bool TerrainGrid::gives_way(Cell quarter) const {
  constexpr int kRays = 12;
  constexpr int kSolidRays = 4;
  const TerrainCell& cell = cells_.at(quarter);
  if (params_.vegetation_m <= 0.0 || cell.stopped + cell.passed < kRays) return false;
  if (cell.passed <= cell.stopped) return false;
  if (cell.high_m - cell.low_m > static_cast<float>(params_.vegetation_m)) return false;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const TerrainCell* const beside = cells_.find({quarter.i + i, quarter.j + j});
      if (beside == nullptr || beside->scans == 0) return false;
      const bool stops = beside->stopped >= kSolidRays && beside->passed < beside->stopped;
      const bool raised = beside->low_m > cell.low_m + kStanding_m && beside->passed < kSolidRays;
      if (stops || raised) return false;
    }
  }
  return true;
}

bool TerrainGrid::soft(Cell cell) const {
  if (params_.vegetation_m <= 0.0) return false;
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (gives_way({2 * cell.i + (quarter & 1), 2 * cell.j + (quarter >> 1)})) return true;
  }
  return false;
}

}  // namespace rcs::wm
