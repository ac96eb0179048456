#pragma once
// What the way to the goal costs from every cell, for a vehicle that turns on the spot: the
// search's heuristic, and what lies beyond its horizon.

#include <limits>
#include <optional>
#include <vector>

#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"

namespace rcs::bg {

/// A circle to be reached.
struct Goal {
  double x_m = 0.0;
  double y_m = 0.0;
  double radius_m = 2.0;
};

/// Dijkstra over the cells of a terrain. Where the goal lies outside, the border's cells are worth
/// the straight way from them. Allocates nothing once it has seen a terrain as large.
class CostField {
 public:
  /// @param body_m      radius of what must be free around the vehicle's middle
  /// @param required_m  to be kept off obstacles, beyond it
  void compute(const vj::Terrain& terrain, const ObstacleDistance& obstacles, const Goal& goal,
               const vj::Weights& weights, double body_m, double required_m);

  /// [m of easy ground]; infinite: no way, or outside of the terrain.
  [[nodiscard]] double at(double x_m, double y_m) const;
  /// The vehicle cannot stand there whichever way it points.
  [[nodiscard]] bool blocked(double x_m, double y_m) const;

  static constexpr double kNoWay = std::numeric_limits<double>::infinity();

 private:
  struct Entry {
    double cost;
    int cell;
  };
  void push(int cell, double cost);
  /// Index of the cell at a place; none outside.
  [[nodiscard]] std::optional<std::size_t> cell_at(double x_m, double y_m) const;

  double cell_m_ = 1.0;
  Cell first_;
  int width_ = 0;
  int height_ = 0;
  std::vector<double> cost_;
  std::vector<double> per_m_;
  std::vector<Entry> heap_;
};

}  // namespace rcs::bg
