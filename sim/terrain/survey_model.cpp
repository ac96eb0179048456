#include "sim/terrain/survey_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "rcs/base/check.h"
#include "rcs/terrain/elevation_map.h"
#include "sim/base/random.h"

namespace rcs::sim {
namespace {

/// Sampling steps along a cell: the ground has no detail below the smallest step.
int samples_along(double cell_m) {
  constexpr double kMin_m = 0.1;
  return std::clamp(static_cast<int>(std::lround(cell_m / kMin_m)), 2, 10);
}

/// The ground under one row of cells, sampled at `side` + 1 positions along each, borders included.
class RowOfCells {
 public:
  RowOfCells(const Relief& relief, const Raster& raster, int row, int side)
      : side_(side), stride_(raster.width * side + 1) {
    const double step_m = raster.level.cell_m / side;
    const std::int64_t i0 = std::int64_t{raster.first.i} * side;
    const std::int64_t j0 = (std::int64_t{raster.first.j} + row) * side;
    relief.fill(i0, j0, step_m, stride_, side + 1, &z_);
  }

  /// Mean over a cell of f(height, a, b) at the sample (a, b) of its [0, side]^2, by the
  /// trapezoidal rule.
  template <class F>
  [[nodiscard]] double mean(int col, const F& f) const {
    double sum = 0.0;
    for (int b = 0; b <= side_; ++b) {
      for (int a = 0; a <= side_; ++a) {
        const double weight = (a % side_ == 0 ? 0.5 : 1.0) * (b % side_ == 0 ? 0.5 : 1.0);
        const float z = z_[static_cast<std::size_t>(b * stride_ + col * side_ + a)];
        sum += weight * f(static_cast<double>(z), a, b);
      }
    }
    return sum / (side_ * side_);
  }

 private:
  int side_;
  int stride_;
  std::vector<float> z_;
};

}  // namespace

PriorMap make_prior_map(const Relief& relief, const Geodetic& datum, const Region& region,
                        const PriorMapParams& params, std::uint64_t seed) {
  const double cell_m = params.cell_m;
  PriorMap map;
  map.frame.datum = datum;
  map.frame.source_crs = "simulation";
  Raster& raster = map.raster;
  // Aligned to cells of frame world, so that two maps of one world share their lattice.
  const Vec2 low = (region.low_world_m / cell_m).array().floor();
  const Vec2 high = (region.high_world_m / cell_m).array().ceil();
  constexpr double kMaxCells = 1e9;
  RCS_CHECK((high - low).minCoeff() > 0.0 && (high - low).prod() <= kMaxCells);
  raster.level = {cell_m, Vec2::Zero(), params.bias_sigma_m, params.bias_correlation_m};
  raster.first = {static_cast<int>(low.x()), static_cast<int>(low.y())};
  raster.width = static_cast<int>(high.x() - low.x());
  raster.height = static_cast<int>(high.y() - low.y());
  raster.source = {CellSource::kAerial};
  raster.sigma_m.clear();

  const int side = samples_along(cell_m);
  for (int row = 0; row < raster.height; ++row) {
    const RowOfCells cells(relief, raster, row, side);
    for (int col = 0; col < raster.width; ++col) {
      raster.z_m.push_back(
          static_cast<float>(cells.mean(col, [](double z, int, int) { return z; })));
    }
  }

  // Interpolation error of the bilinear ground, cell by cell.
  Raster bare = raster;
  bare.sigma_m = {1.0F};
  const Result<ElevationMap> exact = ElevationMap::from_rasters(map.frame, {bare});
  RCS_CHECK(exact.ok());
  const double step_m = cell_m / side;
  for (int row = 0; row < raster.height; ++row) {
    const RowOfCells cells(relief, raster, row, side);
    for (int col = 0; col < raster.width; ++col) {
      const double square = cells.mean(col, [&](double z, int a, int b) {
        Elevation e;
        const bool known = exact->sample((low.x() + col) * cell_m + a * step_m,
                                         (low.y() + row) * cell_m + b * step_m, &e);
        return known ? (z - e.z_m) * (z - e.z_m) : 0.0;  // unknown: the outer half cells of the map
      });
      raster.sigma_m.push_back(static_cast<float>(std::hypot(params.sigma_m, std::sqrt(square))));
    }
  }

  Random random(seed, Stream::kMap);
  const std::uint64_t bias_seed = random.bits();
  std::size_t at = 0;
  for (int row = 0; row < raster.height; ++row) {
    for (int col = 0; col < raster.width; ++col, ++at) {
      const Vec2 p = raster.level.centre({raster.first.i + col, raster.first.j + row});
      const double bias =
          params.bias_sigma_m * Relief::field(bias_seed, params.bias_correlation_m, p.x(), p.y());
      raster.z_m[at] += static_cast<float>(bias + params.sigma_m * random.normal());
    }
  }
  return map;
}

}  // namespace rcs::sim
