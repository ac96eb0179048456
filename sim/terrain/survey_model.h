#pragma once
// An a priori map as a survey would have made it: of the bare ground, coarse, and a little wrong.

#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"
#include "sim/terrain/relief.h"

namespace rcs::sim {

struct PriorMapParams {
  double cell_m = 10.0;
  double sigma_m = 0.3;               ///< of a cell, white
  double bias_sigma_m = 0.3;          ///< slow error
  double bias_correlation_m = 500.0;  ///< of it
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

/// Block means of the bare ground at `cell_m`, plus white noise, plus a slow bias (the sum over a
/// smooth Gaussian field). Never vegetation or rocks. A cell's sigma is the root of the squares of
/// the survey's sigma and of what the ground does between the cells' centres.
[[nodiscard]] PriorMap make_prior_map(const Relief& relief, const Geodetic& datum,
                                      const Region& region, const PriorMapParams& params,
                                      std::uint64_t seed);

}  // namespace rcs::sim
