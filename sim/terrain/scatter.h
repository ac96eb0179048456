#pragma once
// Rocks and vegetation on the ground: rocks, bushes, trees, meadows.

#include <cstdint>
#include <vector>

#include "rcs/base/linear.h"
#include "sim/terrain/relief.h"
#include "sim/terrain/road.h"

namespace rcs::sim {

struct RockParams {
  double per_m2 = 0.02;  ///< mean number
  double radius_min_m = 0.1;
  double radius_max_m = 0.6;  ///< small ones are the more frequent
};

/// Foliage transmits light: the free path in it is exponentially distributed.
struct VegetationParams {
  double patch_m = 15.0;             ///< size of thickets and meadows
  double bushes_per_m2 = 0.01;       ///< mean; none in the meadows
  double trees_per_m2 = 0.003;       ///< mean; none in the meadows
  double transmittance_per_m = 0.2;  ///< share of light that foliage transmits per metre
  double sway_m = 0.08;              ///< amplitude of a crown, bushes 0.3 of it
  double sway_hz = 0.4;
  double grass_height_m = 0.25;  ///< in the meadows
  double grass_transmittance_per_m = 0.4;
};

/// A rock, a bush, a crown or a trunk: a spheroid with an upright axis.
struct Spheroid {
  Vec3 centre_world;
  double radius_m;
  double half_height_m;
  double extinction_1pm;  ///< 0: opaque
  double sway_m;
  double phase_rad;

  /// Centre with the sway of the wind.
  [[nodiscard]] Vec3 centre_at(double time_s, double sway_hz) const;
};

/// Places objects at positions that depend on the seed only.
class Scatter {
 public:
  /// @param course_world  points along the course, at most 1 m apart
  /// @param clear_m  no object is placed closer to them
  /// @param roads  on which nothing is placed
  Scatter(std::uint64_t seed, const RockParams& rocks, const VegetationParams& vegetation,
          const std::vector<Vec2>& course_world, double clear_m, std::vector<Road> roads);

  [[nodiscard]] const VegetationParams& vegetation() const { return vegetation_; }

  /// Adds the objects of square (i, j) of a lattice of edge `size_m` that may extend into the
  /// square (into_i, into_j).
  void grow(int i, int j, int into_i, int into_j, double size_m, const Relief& relief,
            std::vector<Spheroid>* out) const;

  /// True in a meadow, where grass grows; bushes and trees grow elsewhere.
  [[nodiscard]] bool meadow(double x_m, double y_m) const;
  /// The same at the points ((i0 + i) * step_m, (j0 + j) * step_m) of a square, positive in
  /// meadows.
  void fill_meadow(std::int64_t i0, std::int64_t j0, double step_m, int side,
                   std::vector<float>* values) const;

 private:
  /// Of the course and the roads.
  [[nodiscard]] bool clear_of_ways(double x_m, double y_m, double radius_m) const;

  std::uint64_t seed_;
  RockParams rocks_;
  VegetationParams vegetation_;
  std::vector<Road> roads_;
  std::vector<std::uint64_t> near_course_;  ///< 1 m squares too close to the course, sorted
};

}  // namespace rcs::sim
