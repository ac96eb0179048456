#pragma once
// Distance from every cell to the nearest obstacle.

#include <vector>

#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

/// Distances from the centre of each cell of a terrain to the edge of the nearest impassable cell,
/// by propagation of the nearest such cell (Danielsson 1980): exact but for rare errors below a
/// tenth of a cell. Allocates nothing after it was called with a terrain as large.
class ObstacleDistance {
 public:
  void compute(const vj::Terrain& terrain, const vj::Weights& weights);

  /// [m]; at most kFar_m. Interpolated between the centres of cells, so that it changes
  /// continuously with the position. Outside the terrain: kFar_m, as nothing is known there.
  [[nodiscard]] double at(double x_m, double y_m) const {
    const double x = x_m / cell_m_ - 0.5 - first_.i;
    const double y = y_m / cell_m_ - 0.5 - first_.j;
    const double left = std::floor(x);
    const double below = std::floor(y);
    if (!(left >= 0.0 && below >= 0.0 && left < width_ - 1 && below < height_ - 1)) return kFar_m;
    const double* const row = &distance_m_[index(static_cast<int>(left), static_cast<int>(below))];
    const double a = row[0] + (x - left) * (row[1] - row[0]);
    const double* const next = row + width_;
    const double b = next[0] + (x - left) * (next[1] - next[0]);
    return a + (y - below) * (b - a);
  }
  [[nodiscard]] double in_cell(std::size_t index) const { return distance_m_[index]; }

  static constexpr double kFar_m = 50.0;

 private:
  struct Offset {
    int i;
    int j;
  };
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(i);
  }
  void take_from(int i, int j, int di, int dj);

  double cell_m_ = 1.0;
  Cell first_;
  int width_ = 0;
  int height_ = 0;
  std::vector<Offset> nearest_;  // from the cell to the nearest obstacle
  std::vector<double> distance_m_;
};

}  // namespace rcs::bg
