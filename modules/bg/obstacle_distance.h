#pragma once
// How far the nearest obstacle is from every cell.

#include <vector>

#include "modules/vj/value.h"

namespace rcs::bg {

/// Distances from the middle of each cell of a terrain to the edge of the nearest cell that must
/// not be driven over, by propagation of the nearest such cell (Danielsson 1980): exact but for
/// rare errors below a tenth of a cell. Allocates nothing once it has seen a terrain as large.
class ObstacleDistance {
 public:
  void compute(const vj::Terrain& terrain, const vj::Weights& weights);

  /// [m]; at most kFar_m. Outside of the terrain: kFar_m, as nothing is known there.
  [[nodiscard]] double at(double x_m, double y_m) const {
    const Cell c{static_cast<int>(std::floor(x_m / cell_m_)),
                 static_cast<int>(std::floor(y_m / cell_m_))};
    if (c.i < first_.i || c.j < first_.j || c.i >= first_.i + width_ || c.j >= first_.j + height_) {
      return kFar_m;
    }
    return distance_m_[index(c.i - first_.i, c.j - first_.j)];
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
