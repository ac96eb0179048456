#pragma once
// Cost of the path to the goal from every cell, for a vehicle that turns on the spot: the heuristic
// of the search and the cost beyond its horizon.

#include <limits>
#include <optional>
#include <vector>

#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/bg/remembered_ground.h"

namespace rcs::bg {

/// Dijkstra over the cells of a terrain, from the goal and from the border, whose cost is that of
/// the remembered ground. Allocates nothing after it was called with a terrain as large.
class CostField {
 public:
  /// @param beyond      its goal is this goal
  /// @param body_m      radius around the centre of the vehicle that must be free
  /// @param required_m  additional distance from obstacles
  void compute(const vj::Terrain& terrain, const ObstacleDistance& obstacles, const FarCost& beyond,
               const Goal& goal, const vj::Weights& weights, double body_m, double required_m);

  /// [m of easy ground]; infinite: no path, or outside the terrain.
  [[nodiscard]] double at(double x_m, double y_m) const;
  /// The vehicle cannot stand there at any heading.
  [[nodiscard]] bool blocked(double x_m, double y_m) const;

  static constexpr double kNoWay = std::numeric_limits<double>::infinity();

 private:
  struct Entry {
    double cost;
    int cell;
  };
  void push(int cell, double cost);
  /// Index of the cell that contains the point; none outside.
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
