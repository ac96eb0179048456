#pragma once
// A simulated a priori map from a survey: bare ground, coarse, with systematic and white errors.

#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"
#include "sim/terrain/relief.h"

namespace rcs::sim {

struct PriorMapParams {
  double cell_m = 10.0;
  double sigma_m = 0.3;               ///< white error of a cell
  double bias_sigma_m = 0.3;          ///< systematic error
  double bias_correlation_m = 500.0;  ///< correlation length of the systematic error
  double margin_m = 100.0;            ///< around the course
};

struct Region {
  Vec2 low_world_m;
  Vec2 high_world_m;
};

struct PriorMap {
  MapFrame frame;
  Raster raster;
};

/// Block means of the bare ground at `cell_m`, plus white noise, plus a systematic error (the sum
/// over a smooth Gaussian field). Never vegetation or rocks. The sigma of a cell combines that of
/// the survey with the interpolation error of the ground between the centres of cells.
[[nodiscard]] PriorMap make_prior_map(const Relief& relief, const Geodetic& datum,
                                      const Region& region, const PriorMapParams& params,
                                      std::uint64_t seed);

}  // namespace rcs::sim
