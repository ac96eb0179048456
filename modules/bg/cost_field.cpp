#include "modules/bg/cost_field.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

bool later(double a, double b) { return a > b; }

}  // namespace

void CostField::push(int cell, double cost) {
  double& known = cost_[static_cast<std::size_t>(cell)];
  if (cost >= known) return;
  known = cost;
  heap_.push_back({cost, cell});
  std::push_heap(heap_.begin(), heap_.end(),
                 [](const Entry& a, const Entry& b) { return later(a.cost, b.cost); });
}

void CostField::compute(const vj::Terrain& terrain, const ObstacleDistance& obstacles,
                        const FarCost& beyond, const Goal& goal, const vj::Weights& weights,
                        double body_m, double required_m) {
  cell_m_ = terrain.cell_m;
  first_ = terrain.first;
  width_ = terrain.width;
  height_ = terrain.height;
  const std::size_t count = terrain.ground.size();
  cost_.assign(count, kNoWay);
  per_m_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double clearance_m = obstacles.in_cell(k) - body_m;
    per_m_[k] =
        clearance_m < required_m ? kNoWay : vj::cost_per_m(terrain.ground[k], clearance_m, weights);
  }

  heap_.clear();
  heap_.reserve(8 * count);  // each edge enters at most once
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) {
      const int cell = j * width_ + i;
      if (std::isinf(per_m_[static_cast<std::size_t>(cell)])) continue;
      const double x_m = (first_.i + i + 0.5) * cell_m_;
      const double y_m = (first_.j + j + 0.5) * cell_m_;
      const bool border = i == 0 || j == 0 || i == width_ - 1 || j == height_ - 1;
      if (std::hypot(x_m - goal.x_m, y_m - goal.y_m) < goal.radius_m) {
        push(cell, 0.0);
      } else if (border) {
        push(cell, beyond.at(x_m, y_m));
      }
    }
  }

  const double diagonal = std::sqrt(2.0);
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(),
                  [](const Entry& a, const Entry& b) { return later(a.cost, b.cost); });
    const Entry entry = heap_.back();
    heap_.pop_back();
    const std::size_t here = static_cast<std::size_t>(entry.cell);
    if (entry.cost > cost_[here]) continue;
    const int i = entry.cell % width_;
    const int j = entry.cell / width_;
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int a = i + di;
        const int b = j + dj;
        if ((di == 0 && dj == 0) || a < 0 || b < 0 || a >= width_ || b >= height_) continue;
        const int next = b * width_ + a;
        const double per_m = 0.5 * (per_m_[here] + per_m_[static_cast<std::size_t>(next)]);
        if (std::isinf(per_m)) continue;
        push(next, entry.cost + per_m * cell_m_ * (di != 0 && dj != 0 ? diagonal : 1.0));
      }
    }
  }
}

std::optional<std::size_t> CostField::cell_at(double x_m, double y_m) const {
  const int i = static_cast<int>(std::floor(x_m / cell_m_)) - first_.i;
  const int j = static_cast<int>(std::floor(y_m / cell_m_)) - first_.j;
  if (i < 0 || j < 0 || i >= width_ || j >= height_) return std::nullopt;
  return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
         static_cast<std::size_t>(i);
}

double CostField::at(double x_m, double y_m) const {
  const std::optional<std::size_t> cell = cell_at(x_m, y_m);
  return cell ? cost_[*cell] : kNoWay;
}

bool CostField::blocked(double x_m, double y_m) const {
  const std::optional<std::size_t> cell = cell_at(x_m, y_m);
  return cell && std::isinf(per_m_[*cell]);
}

}  // namespace rcs::bg
