#pragma once
// Heights and sigmas of the cells of a map from the ground points of a survey.

#include <array>
#include <cstdint>
#include <vector>

#include "rcs/terrain/raster.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

struct SurveyGroundMetrics {
  std::int64_t points = 0;            ///< added
  std::int64_t cells = 0;             ///< with a height
  double within_cell_median_m = 0.0;  ///< standard deviation of the points within a cell
  double sigma_median_m = 0.0;
};

/// Accepts any number of points; 16 are kept for each cell by uniform reservoir sampling (Vitter,
/// algorithm R, 1985), deterministically. Memory is proportional to the area. Heights are stored
/// relative to a surface, which removes the slope of the cells.
class SurveyGround {
 public:
  /// Meaning of points above the ground.
  enum class Above {
    kNoise,  ///< noise, as points below it: the ground was classified
    kPlants  ///< low plants among the points: the ground is the lowest mode
  };

  /// @param surface  all known; must outlive this
  SurveyGround(const MapLevel& level, const Raster* surface, Above above)
      : level_(level), surface_(surface), above_(above) {}

  /// @param p  in the frame of the map
  void add(const Vec3& p);
  /// Call it after the last point.
  /// @param sigma_m  of the heights of the survey
  void finish(double sigma_m);

  [[nodiscard]] const SurveyGroundMetrics& metrics() const { return metrics_; }
  [[nodiscard]] std::size_t bytes() const { return places_.bytes(); }
  /// The tiles of the map with known heights, by j, then i.
  [[nodiscard]] std::vector<Cell> tiles() const;
  /// Heights, sigmas and counts of points of one tile.
  [[nodiscard]] Raster tile(Cell number) const;

 private:
  static constexpr std::size_t kKept = 16;
  struct CellStatistics {
    std::uint32_t points = 0;
    std::array<float, kKept> above_m{};  // the surface; after finish(): z, sigma, sum of squares
    std::uint16_t used = 0;              // of the kept points, after finish()
    [[nodiscard]] float z_m() const { return above_m[0]; }
    [[nodiscard]] float sigma_m() const { return above_m[1]; }
    [[nodiscard]] float squares() const { return above_m[2]; }
  };
  void measure(Cell c, CellStatistics* place) const;
  [[nodiscard]] std::pair<double, int> around(Cell c) const;

  MapLevel level_;
  const Raster* surface_;
  Above above_;
  CellBlocks<CellStatistics> places_;
  SurveyGroundMetrics metrics_;
};

}  // namespace rcs::mapping
