#pragma once
// Maps for the tests of rcs/terrain.

#include <cmath>
#include <limits>
#include <random>

#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::test {

inline MapFrame frame() {
  MapFrame f;
  f.datum = {radians(40.43), radians(-76.57), {150.0}};
  f.source_crs = "EPSG:32618";
  return f;
}

/// Random heights: no two cells are equal.
inline Raster random_raster(unsigned seed, Cell first, int width, int height) {
  Raster r;
  r.level = {2.5, Vec2(10.0, -5.0), 0.5, 500.0};
  r.first = first;
  r.width = width;
  r.height = height;
  std::mt19937 rng(seed);
  std::normal_distribution<float> normal(10.0F, 3.0F);
  for (std::size_t k = 0; k < r.cells(); ++k) r.z_m.push_back(normal(rng));
  r.sigma_m = {0.3F};
  r.count = {1};
  r.date = {8000};
  r.source = {CellSource::kAerial};
  return r;
}

/// A smooth surface, its sigma by cell, some cells unknown.
inline Raster hills(const MapLevel& level, Cell first, int width, int height) {
  Raster r;
  r.level = level;
  r.first = first;
  r.width = width;
  r.height = height;
  r.sigma_m.clear();
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const Vec2 p = level.centre({first.i + i, first.j + j});
      r.z_m.push_back(static_cast<float>(8.0 * std::sin(0.01 * p.x()) * std::cos(0.013 * p.y())));
      r.sigma_m.push_back(0.1F + 0.001F * static_cast<float>((i + 2 * j) % 50));
    }
  }
  return r;
}

/// Points all over a raster's extent, with normals all around.
inline std::vector<SurfacePoint> random_points(unsigned seed, const Raster& r, std::size_t n) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> u(0.0F, 0.999F);
  const auto wide_m = static_cast<float>(r.width * r.level.cell_m);
  const auto high_m = static_cast<float>(r.height * r.level.cell_m);
  std::vector<SurfacePoint> points;
  for (std::size_t k = 0; k < n; ++k) {
    const float turn = 6.28F * u(rng);
    points.push_back({{wide_m * u(rng), high_m * u(rng), 10.0F * u(rng)},
                      {std::cos(turn), std::sin(turn), 0.0F},
                      0.01F + u(rng)});
  }
  return points;
}

inline bool same(const Raster& a, const Raster& b) {
  if (!(a.level == b.level && a.first == b.first && a.width == b.width && a.height == b.height)) {
    return false;
  }
  if (!(a.points == b.points)) return false;
  for (std::size_t k = 0; k < a.cells(); ++k) {
    const bool z = a.z_m[k] == b.z_m[k] || (std::isnan(a.z_m[k]) && std::isnan(b.z_m[k]));
    if (!z || layer_at(a.sigma_m, k) != layer_at(b.sigma_m, k) ||
        layer_at(a.count, k) != layer_at(b.count, k) ||
        layer_at(a.date, k) != layer_at(b.date, k) ||
        layer_at(a.source, k) != layer_at(b.source, k)) {
      return false;
    }
  }
  return true;
}

}  // namespace rcs::test
