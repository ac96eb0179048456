#include "rcs/terrain/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace rcs {
namespace {

constexpr int kFarthestCell = 1 << 30;

template <class T>
bool layer_fits(const std::vector<T>& layer, std::size_t cells) {
  return layer.size() == 1 || layer.size() == cells;
}

template <class T>
void copy_row(const std::vector<T>& from, std::size_t begin, std::size_t n, std::size_t to,
              std::vector<T>* out) {
  if (from.size() == 1) return;
  std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(begin), n,
              out->begin() + static_cast<std::ptrdiff_t>(to));
}

template <class T>
std::vector<T> like(const std::vector<T>& layer, std::size_t cells) {
  return std::vector<T>(layer.size() == 1 ? 1 : cells, layer.front());
}

}  // namespace

Outcome check_level(const MapLevel& level) {
  if (!(level.cell_m >= 0.01 && level.cell_m <= 10000.0)) {
    return Error{"a cell must be 0.01 to 10000 m wide"};
  }
  if (!(level.origin_m.cwiseAbs().maxCoeff() <= 1e6)) {
    return Error{"the lattice's origin must be within 1000 km of the datum"};
  }
  if (!(level.bias_sigma_m >= 0.0 && level.bias_sigma_m <= 1000.0)) {
    return Error{"bias sigma must be in [0, 1000] m"};
  }
  if (!(level.bias_correlation_m > 0.0 && level.bias_correlation_m <= 1e7)) {
    return Error{"bias correlation must be in (0, 1e7] m"};
  }
  return Done{};
}

Outcome check_raster(const Raster& r) {
  if (Outcome level = check_level(r.level); !level) return level;
  if (r.width < 1 || r.height < 1) return Error{"a raster needs at least one cell"};
  const auto far = [](int first, int n) {
    return first < -kFarthestCell || first > kFarthestCell - n;
  };
  if (far(r.first.i, r.width) || far(r.first.j, r.height)) {
    return Error{"a cell's number is beyond 2^30"};
  }
  const std::size_t n = r.cells();
  if (r.z_m.size() != n) return Error{"heights must be width x height"};
  if (!layer_fits(r.sigma_m, n) || !layer_fits(r.count, n) || !layer_fits(r.date, n) ||
      !layer_fits(r.source, n)) {
    return Error{"a layer must have one value, or width x height"};
  }
  for (const float z : r.z_m) {
    if (std::abs(z) > 20000.0F) return Error{"a height is beyond 20 km"};  // NaN passes: unknown
  }
  for (const float s : r.sigma_m) {
    if (!(s > 0.0F && s <= 1000.0F)) return Error{"a sigma is not in (0, 1000] m"};
  }
  for (const CellSource s : r.source) {
    if (static_cast<int>(s) >= kCellSources) return Error{"the source of a cell is invalid"};
  }
  return check_surface_points(r.points, r.width * r.level.cell_m, r.height * r.level.cell_m);
}

Raster cut(const Raster& raster, Cell first, int width, int height) {
  Raster out;
  out.level = raster.level;
  out.first = first;
  out.width = width;
  out.height = height;
  const std::size_t n = out.cells();
  out.z_m.assign(n, std::numeric_limits<float>::quiet_NaN());
  out.sigma_m = like(raster.sigma_m, n);
  out.count = like(raster.count, n);
  out.date = like(raster.date, n);
  out.source = like(raster.source, n);
  const int low_i = std::max(first.i, raster.first.i);
  const int high_i = std::min(first.i + width, raster.first.i + raster.width);
  const int low_j = std::max(first.j, raster.first.j);
  const int high_j = std::min(first.j + height, raster.first.j + raster.height);
  const Vec2 moved_m =
      raster.level.cell_m * Vec2(raster.first.i - first.i, raster.first.j - first.j);
  for (const SurfacePoint& p : raster.points) {
    const Vec2 at = p.p_m.head<2>().cast<double>() + moved_m;
    SurfacePoint moved = p;
    moved.p_m.head<2>() = at.cast<float>();
    if (at.minCoeff() >= 0.0 && moved.p_m.x() < width * raster.level.cell_m &&
        moved.p_m.y() < height * raster.level.cell_m) {
      out.points.push_back(moved);
    }
  }
  if (low_i >= high_i) return out;
  const auto row = static_cast<std::size_t>(high_i - low_i);
  for (int j = low_j; j < high_j; ++j) {
    const std::size_t from = raster.at({low_i, j});
    const std::size_t to = out.at({low_i, j});
    std::copy_n(raster.z_m.begin() + static_cast<std::ptrdiff_t>(from), row,
                out.z_m.begin() + static_cast<std::ptrdiff_t>(to));
    copy_row(raster.sigma_m, from, row, to, &out.sigma_m);
    copy_row(raster.count, from, row, to, &out.count);
    copy_row(raster.date, from, row, to, &out.date);
    copy_row(raster.source, from, row, to, &out.source);
  }
  return out;
}

}  // namespace rcs
