#pragma once
// Density and coverage of the points of a survey: the default cell of its map, and warnings.

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::survey {

struct DensityMetrics {
  std::int64_t points = 0;
  double surveyed_m2 = 0.0;      ///< bins with a point
  double points_per_m2 = 0.0;    ///< in the surveyed area
  double largest_hole_m2 = 0.0;  ///< connected bins without a point, enclosed by the survey
  double lowest_m = 0.0;         ///< height
  double highest_m = 0.0;
  double duplicate_share = 0.0;  ///< points with the coordinates of an earlier one, estimated
};

/// The area is divided into at most 1024 x 1024 square bins of 16 points on average; a bin with a
/// point is surveyed. Duplicates are counted on a sample that is chosen by the hash of the
/// coordinates, so that equal points are sampled together. Memory is bounded.
class PointDensity {
 public:
  /// @param low, high  extent of the points [m]
  /// @param points  approximate number
  PointDensity(const Vec2& low, const Vec2& high, std::int64_t points);

  void add(const Vec3& p);
  [[nodiscard]] DensityMetrics metrics() const;

 private:
  void sample(const Vec3& p);
  [[nodiscard]] double largest_hole_m2() const;

  Vec2 low_;
  double bin_m_ = 1.0;
  int width_ = 1;
  int height_ = 1;
  std::vector<std::uint8_t> surveyed_;  // by j, then i
  DensityMetrics counted_;
  std::uint64_t mask_ = 0;  // a hash is sampled if these bits are zero
  std::int64_t sampled_ = 0;
  std::unordered_set<std::uint64_t> distinct_;
};

constexpr double kPointsPerCell = 3.5;

/// The smallest cell of 0.25, 0.5, 1, 2, 5, 10, 20, 50 and 100 m with 3.5 points or more on
/// average: of independent points 3 % of the cells are empty then.
[[nodiscard]] double cell_of_density(double points_per_m2);

/// Properties of a survey that are probably errors, one sentence each.
/// @param cell_m  of the map
/// @param ground_cells  of the map, with a height
[[nodiscard]] std::vector<std::string> density_warnings(const DensityMetrics& density,
                                                        double cell_m, std::int64_t ground_cells);

}  // namespace rcs::survey
