#pragma once
// Heights and sigmas of a map's cells from a survey's points of the ground.

#include <array>
#include <cstdint>
#include <vector>

#include "rcs/terrain/raster.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

struct SurveyGroundFigures {
  std::int64_t points = 0;       ///< that were added
  std::int64_t cells = 0;        ///< with a height
  double spread_median_m = 0.0;  ///< of the points about the ground within a cell
  double sigma_median_m = 0.0;
};

/// Points come in any number; of each cell 16 are kept, drawn so that each point is as likely to be
/// one (Vitter's algorithm R, 1985), the same ones each time. Memory grows by the area. Heights are
/// kept as differences to a surface that takes the slope out of the cells.
class SurveyGround {
 public:
  /// What points above the ground mean.
  enum class Above {
    kNoise,  ///< as much as points below it: somebody has told the ground from the rest
    kPlants  ///< low plants among the points: the ground is where the lowest gather
  };

  /// @param surface  all known; outlives this
  SurveyGround(const MapLevel& level, const Raster* surface, Above above)
      : level_(level), surface_(surface), above_(above) {}

  /// @param p  in the map's frame
  void add(const Vec3& p);
  /// After the last point.
  /// @param sigma_m  of the survey's heights
  void finish(double sigma_m);

  [[nodiscard]] const SurveyGroundFigures& figures() const { return figures_; }
  [[nodiscard]] std::size_t bytes() const { return places_.bytes(); }
  /// The map's tiles that hold a height, by j, then i.
  [[nodiscard]] std::vector<Cell> tiles() const;
  /// Of one of them heights, sigmas and counts of points.
  [[nodiscard]] Raster tile(Cell number) const;

 private:
  static constexpr std::size_t kKept = 16;
  struct Place {
    std::uint32_t points = 0;
    std::array<float, kKept> above_m{};  // the surface; once finished: z, sigma, squares' sum
    std::uint16_t used = 0;              // of what is kept, when finished
    [[nodiscard]] float z_m() const { return above_m[0]; }
    [[nodiscard]] float sigma_m() const { return above_m[1]; }
    [[nodiscard]] float squares() const { return above_m[2]; }
  };
  void measure(Cell c, Place* place) const;
  [[nodiscard]] std::pair<double, int> around(Cell c) const;

  MapLevel level_;
  const Raster* surface_;
  Above above_;
  CellBlocks<Place> places_;
  SurveyGroundFigures figures_;
};

}  // namespace rcs::mapping
