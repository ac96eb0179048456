#include "modules/bg/remembered_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace rcs::bg {
namespace {

constexpr int kCells = RememberedGround::kCells;
constexpr double kCell_m = RememberedGround::kCell_m;
constexpr std::size_t kRow = kCells + 2;
constexpr float kBucket = 0.2F;         // cost: a quarter of the cheapest cell
constexpr std::size_t kBuckets = 8192;  // more than the most expensive cell costs diagonally
constexpr std::int32_t kNone = -1;

std::size_t bucket_of(float cost) { return static_cast<std::size_t>(cost / kBucket) % kBuckets; }
// A way out of the terrain and back into it must not be cheaper than the path through it.
constexpr double kPessimism = 1.1;
constexpr double kLeave_m = 1.6;  // from a place too near to an obstacle to free ground
// Cost of a metre over ground that the vehicle has driven over and that is blocked now: more than
// of all other ground where it can stand.
constexpr float kTight = 40.0F;
constexpr double kContinuous_m = 5.0;  // a longer step between two terrains was not driven
constexpr float kDiagonal = 1.41421356F;
constexpr float kFar = std::numeric_limits<float>::infinity();

}  // namespace

RememberedGround::RememberedGround() : per_m_(kCells, kCell_m, 0.0F), driven_(kCells, kCell_m) {}

FarCost::FarCost()
    : step_(kRow * kRow, 0.0F),
      offered_(kRow * kRow, kFar),
      accepted_(kRow * kRow, kFar),
      way_(kRow * kRow, Way::kOutside),
      buckets_(kBuckets, kNone) {
  entries_.reserve(8 * way_.size());  // each cell is offered by at most eight neighbours
}

void RememberedGround::note(const Pose2d& vehicle, const vj::Terrain& terrain,
                            const ObstacleDistance& obstacles, const vj::Weights& weights,
                            double body_m) {
  per_m_.centre_on(per_m_.cell_at(vehicle.x_m, vehicle.y_m));
  mark_driven(vehicle);
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
        *remembered = driven_.at({i, j}) != 0 ? kTight : kBlocked;
      } else if (known > 0) {
        *remembered = static_cast<float>(kPessimism * sum / free);
      } else if (*remembered >= kBlocked) {
        *remembered = 0.0F;  // the obstacle has gone, and what was behind it was not seen
      }
    }
  }
}

void RememberedGround::mark_driven(const Pose2d& vehicle) {
  driven_.centre_on(driven_.cell_at(vehicle.x_m, vehicle.y_m));
  const Pose2d from = last_.value_or(vehicle);
  last_ = vehicle;
  const double way_m = std::hypot(vehicle.x_m - from.x_m, vehicle.y_m - from.y_m);
  if (way_m > kContinuous_m) return;
  const int steps = static_cast<int>(way_m / (0.5 * kCell_m)) + 1;
  for (int k = 0; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    const Cell cell = driven_.cell_at(from.x_m + share * (vehicle.x_m - from.x_m),
                                      from.y_m + share * (vehicle.y_m - from.y_m));
    if (std::uint8_t* const driven = driven_.find(cell)) *driven = 1;
  }
}

std::size_t FarCost::index_of(Cell c) const {
  return static_cast<std::size_t>(c.j - origin_.j + 1) * kRow +
         static_cast<std::size_t>(c.i - origin_.i + 1);
}

void FarCost::offer(std::size_t cell, float cost) {
  if (cost >= offered_[cell]) return;
  offered_[cell] = cost;
  std::int32_t& first = buckets_[bucket_of(cost)];
  entries_.push_back({static_cast<std::int32_t>(cell), first});
  first = static_cast<std::int32_t>(entries_.size()) - 1;
  ++waiting_;
}

float FarCost::solve(std::size_t cell) const {
  const float* const at = &accepted_[cell];
  float a = std::min(*(at - 1), *(at + 1));
  float b = std::min(*(at - kRow), *(at + kRow));
  if (b < a) std::swap(a, b);
  const float step = step_[cell];
  // From a corner, too: a narrow passage may lead from cell to cell diagonally.
  const float corner =
      std::min({*(at - kRow - 1), *(at - kRow + 1), *(at + kRow - 1), *(at + kRow + 1)}) +
      kDiagonal * step;
  const float apart = b - a;
  if (!(apart < step)) return std::min(corner, a + step);
  return std::min(corner, 0.5F * (a + b + std::sqrt(2.0F * step * step - apart * apart)));
}

void FarCost::begin(const Grid<float>& per_m, const std::vector<std::uint8_t>* forbidden) {
  computed_ = true;
  origin_ = per_m.origin();
  std::fill(offered_.begin(), offered_.end(), kFar);
  std::fill(accepted_.begin(), accepted_.end(), kFar);
  entries_.clear();
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const Cell c{origin_.i + i, origin_.j + j};
      const float seen = per_m.at(c);
      float cost = seen > 0.0F ? seen : float{kUnseen};
      if (forbidden != nullptr && (*forbidden)[static_cast<std::size_t>(j * kCells + i)] != 0) {
        cost = RememberedGround::kBlocked;
      }
      step_[index_of(c)] = static_cast<float>(kCell_m) * cost;
      way_[index_of(c)] = Way::kOpen;
    }
  }
}

void FarCost::accept(std::size_t cell) {
  // The cheapest way leads over the cheapest neighbour; the goal has none that is cheaper.
  std::size_t from = cell;
  float least = offered_[cell];
  for (const std::size_t row : {cell - kRow, cell, cell + kRow}) {
    for (const std::size_t n : {row - 1, row, row + 1}) {
      if (accepted_[n] >= least) continue;
      least = accepted_[n];
      from = n;
    }
  }
  const bool blocked = step_[cell] >= static_cast<float>(kCell_m) * RememberedGround::kBlocked;
  const bool free = from == cell || (!blocked && way_[from] == Way::kFree);
  way_[cell] = free ? Way::kFree : Way::kBlocked;
  accepted_[cell] = offered_[cell];
}

void FarCost::compute(const RememberedGround& ground, const Goal& goal,
                      const std::vector<std::uint8_t>* forbidden) {
  const Grid<float>& per_m = ground.per_m();
  goal_ = goal;
  begin(per_m, forbidden);
  const bool inside = per_m.contains(per_m.cell_at(goal.x_m, goal.y_m));
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const bool border = i == 0 || j == 0 || i == kCells - 1 || j == kCells - 1;
      if (!inside && !border) continue;
      const Cell c{origin_.i + i, origin_.j + j};
      const double away_m =
          std::hypot((c.i + 0.5) * kCell_m - goal.x_m, (c.j + 0.5) * kCell_m - goal.y_m);
      if (!inside) {
        offer(index_of(c), static_cast<float>(kUnseen * away_m));
      } else if (away_m < std::max(goal.radius_m, kCell_m)) {
        offer(index_of(c), 0.0F);
      }
    }
  }
  march();
}

void FarCost::march() {
  const auto cheapest = std::min_element(offered_.begin(), offered_.end());
  for (std::size_t at = bucket_of(*cheapest); waiting_ > 0; at = (at + 1) % kBuckets) {
    // An accepted cell can offer a neighbour at a cost of the same bucket.
    while (buckets_[at] != kNone) {
      const Entry entry = entries_[static_cast<std::size_t>(buckets_[at])];
      buckets_[at] = entry.next;
      --waiting_;
      const auto cell = static_cast<std::size_t>(entry.cell);
      if (way_[cell] != Way::kOpen) continue;
      accept(cell);
      for (const std::size_t row : {cell - kRow, cell, cell + kRow}) {
        for (const std::size_t n : {row - 1, row, row + 1}) {
          if (way_[n] == Way::kOpen) offer(n, solve(n));
        }
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
  return cell ? accepted_[*cell] : kUnseen * std::hypot(x_m - goal_.x_m, y_m - goal_.y_m);
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
