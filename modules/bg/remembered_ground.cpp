#include "modules/bg/remembered_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace rcs::bg {
namespace {

constexpr int kCells = 256;
// Two cells of the terrain: the vehicle keeps away from an obstacle by more than a metre, so that
// even a thin wall is blocked over two cells or more, and no path leads through it diagonally.
constexpr double kCell_m = 0.8;
// A way out of the terrain and back into it must not look cheaper than the way through it.
constexpr double kPessimism = 1.1;
constexpr double kLeave_m = 1.6;  // from a place too near to an obstacle to free ground
constexpr float kDiagonal = 1.41421356F;
constexpr float kFar = std::numeric_limits<float>::infinity();

bool later(float a, float b) { return a > b; }

}  // namespace

RememberedGround::RememberedGround() : per_m_(kCells, kCell_m, 0.0F) {}

FarCost::FarCost()
    : cost_(static_cast<std::size_t>(kCells) * kCells, kFar), way_(cost_.size(), Way::kOpen) {
  heap_.reserve(8 * cost_.size());  // each cell is offered by at most eight neighbours
}

void RememberedGround::note(const Place& vehicle, const vj::Terrain& terrain,
                            const ObstacleDistance& obstacles, const vj::Weights& weights,
                            double body_m) {
  per_m_.centre_on(per_m_.cell_at(vehicle.x_m, vehicle.y_m));
  // Only cells that lie wholly in the terrain: of the others a part was not seen now.
  const int side = std::max(1, static_cast<int>(std::lround(kCell_m / terrain.cell_m)));
  const auto up = [](int a, int b) { return a >= 0 ? (a + b - 1) / b : -(-a / b); };
  const Cell first{up(terrain.first.i, side), up(terrain.first.j, side)};
  for (int j = first.j; (j + 1) * side <= terrain.first.j + terrain.height; ++j) {
    for (int i = first.i; (i + 1) * side <= terrain.first.i + terrain.width; ++i) {
      float* const remembered = per_m_.find({i, j});
      if (remembered == nullptr) continue;
      double sum = 0.0;
      int free = 0;
      int known = 0;
      for (int b = 0; b < side; ++b) {
        for (int a = 0; a < side; ++a) {
          const std::size_t k = terrain.index({i * side + a, j * side + b});
          const double clearance_m = obstacles.in_cell(k) - body_m;
          known += terrain.ground[k].known ? 1 : 0;
          if (clearance_m < 0.0) continue;
          ++free;
          sum += vj::cost_per_m(terrain.ground[k], clearance_m, weights);
        }
      }
      if (free == 0) {
        *remembered = kBlocked;
      } else if (known > 0) {
        *remembered = static_cast<float>(kPessimism * sum / free);
      } else if (*remembered >= kBlocked) {
        *remembered = 0.0F;  // the obstacle has gone, and what was behind it was not seen
      }
    }
  }
}

std::size_t FarCost::index_of(Cell c) const {
  return static_cast<std::size_t>(c.j - origin_.j) * kCells +
         static_cast<std::size_t>(c.i - origin_.i);
}

void FarCost::offer(Cell c, float cost) {
  float& known = cost_[index_of(c)];
  if (cost >= known) return;
  known = cost;
  heap_.push_back({cost, static_cast<int>(index_of(c))});
  std::push_heap(heap_.begin(), heap_.end(),
                 [](const Entry& a, const Entry& b) { return later(a.cost, b.cost); });
}

float FarCost::solve(const Grid<float>& per_m, Cell c) const {
  const auto accepted = [this, &per_m](Cell n) {
    return per_m.contains(n) && way_[index_of(n)] != Way::kOpen ? cost_[index_of(n)] : kFar;
  };
  float a = std::min(accepted({c.i - 1, c.j}), accepted({c.i + 1, c.j}));
  float b = std::min(accepted({c.i, c.j - 1}), accepted({c.i, c.j + 1}));
  if (b < a) std::swap(a, b);
  const float seen = per_m.at(c);
  const float step = static_cast<float>(kCell_m) * (seen > 0.0F ? seen : float{kUnseen});
  // From a corner, too: a narrow passage may lead from cell to cell diagonally.
  const float corner = std::min({accepted({c.i - 1, c.j - 1}), accepted({c.i - 1, c.j + 1}),
                                 accepted({c.i + 1, c.j - 1}), accepted({c.i + 1, c.j + 1})}) +
                       kDiagonal * step;
  const float apart = b - a;
  if (!(apart < step)) return std::min(corner, a + step);
  return std::min(corner, 0.5F * (a + b + std::sqrt(2.0F * step * step - apart * apart)));
}

bool FarCost::is_free(const Grid<float>& per_m, Cell c) const {
  std::size_t from = index_of(c);
  for (int j = c.j - 1; j <= c.j + 1; ++j) {
    for (int i = c.i - 1; i <= c.i + 1; ++i) {
      const Cell n{i, j};
      if (!per_m.contains(n) || way_[index_of(n)] == Way::kOpen) continue;
      if (cost_[index_of(n)] < cost_[from]) from = index_of(n);
    }
  }
  const bool begins_here = from == index_of(c);
  if (begins_here) return true;
  return per_m.at(c) < RememberedGround::kBlocked && way_[from] == Way::kFree;
}

void FarCost::compute(const RememberedGround& ground, const Goal& goal) {
  const Grid<float>& per_m = ground.per_m();
  goal_ = goal;
  computed_ = true;
  origin_ = per_m.origin();
  std::fill(cost_.begin(), cost_.end(), kFar);
  std::fill(way_.begin(), way_.end(), Way::kOpen);
  heap_.clear();
  const auto away_m = [&goal](Cell c) {
    return std::hypot((c.i + 0.5) * kCell_m - goal.x_m, (c.j + 0.5) * kCell_m - goal.y_m);
  };
  const bool inside = per_m.contains(per_m.cell_at(goal.x_m, goal.y_m));
  const auto cell_of = [this](int index) {
    return Cell{origin_.i + index % kCells, origin_.j + index / kCells};
  };
  for (int k = 0; k < kCells * kCells; ++k) {
    const Cell c = cell_of(k);
    const int i = c.i - origin_.i;
    const int j = c.j - origin_.j;
    const bool border = i == 0 || j == 0 || i == kCells - 1 || j == kCells - 1;
    if (inside ? away_m(c) < std::max(goal.radius_m, kCell_m) : border) {
      offer(c, inside ? 0.0F : static_cast<float>(kUnseen * away_m(c)));
    }
  }
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(),
                  [](const Entry& a, const Entry& b) { return later(a.cost, b.cost); });
    const Entry entry = heap_.back();
    heap_.pop_back();
    Way& way = way_[static_cast<std::size_t>(entry.cell)];
    if (way != Way::kOpen) continue;
    const Cell c = cell_of(entry.cell);
    way = is_free(per_m, c) ? Way::kFree : Way::kBlocked;
    for (int j = c.j - 1; j <= c.j + 1; ++j) {
      for (int i = c.i - 1; i <= c.i + 1; ++i) {
        const Cell n{i, j};
        if (per_m.contains(n) && way_[index_of(n)] == Way::kOpen) offer(n, solve(per_m, n));
      }
    }
  }
}

std::optional<std::size_t> FarCost::cell_at(double x_m, double y_m) const {
  const Cell c{cell_index(x_m / kCell_m), cell_index(y_m / kCell_m)};
  const bool within =
      c.i >= origin_.i && c.i < origin_.i + kCells && c.j >= origin_.j && c.j < origin_.j + kCells;
  if (!computed_ || !within) return std::nullopt;
  return index_of(c);
}

double FarCost::at(double x_m, double y_m) const {
  const std::optional<std::size_t> cell = cell_at(x_m, y_m);
  return cell ? cost_[*cell] : kUnseen * std::hypot(x_m - goal_.x_m, y_m - goal_.y_m);
}

bool FarCost::reachable_from(double x_m, double y_m) const {
  for (double dy = -kLeave_m; dy <= kLeave_m; dy += kCell_m) {
    for (double dx = -kLeave_m; dx <= kLeave_m; dx += kCell_m) {
      const std::optional<std::size_t> cell = cell_at(x_m + dx, y_m + dy);
      if (!cell || way_[*cell] == Way::kFree) return true;
    }
  }
  return false;
}

}  // namespace rcs::bg
