#include "rcs/terrain/elevation_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <system_error>

namespace rcs {
namespace {

constexpr std::int64_t kMaxNodes = std::int64_t{1} << 27;  // 1.5 GB of nodes

// Offset of a tile in whole cells from `origin`, or false when it is not on the lattice.
bool lattice_offset(double tile_origin_m, double origin_m, double cell_m, std::int64_t* cells) {
  const double exact = (tile_origin_m - origin_m) / cell_m;
  const double whole = std::round(exact);
  *cells = static_cast<std::int64_t>(whole);
  return std::abs(exact - whole) < 1e-3;
}

bool same_survey(const ElevationTile& a, const ElevationTile& b) {
  return a.datum.lat_rad == b.datum.lat_rad && a.datum.lon_rad == b.datum.lon_rad &&
         a.datum.height.m == b.datum.height.m && a.cell_m == b.cell_m &&
         a.bias_sigma_m == b.bias_sigma_m && a.bias_correlation_m == b.bias_correlation_m;
}

}  // namespace

Result<ElevationMap> ElevationMap::load(const std::string& path) {
  std::error_code error;
  std::vector<std::string> files;
  if (std::filesystem::is_directory(path, error)) {
    for (std::filesystem::directory_iterator it(path, error), end; !error && it != end;
         it.increment(error)) {
      if (it->path().extension() == ".tile") files.push_back(it->path().string());
    }
    if (error) return Error{path + ": " + error.message()};
    std::sort(files.begin(), files.end());
    if (files.empty()) return Error{path + ": no *.tile in this directory"};
  } else {
    files.push_back(path);
  }
  std::vector<ElevationTile> tiles;
  for (const std::string& file : files) {
    Result<std::vector<ElevationTile>> read = read_tiles(file);
    if (!read) return read.error();
    for (ElevationTile& tile : *read) tiles.push_back(std::move(tile));
  }
  Result<ElevationMap> map = from_tiles(tiles);
  if (!map) return Error{path + ": " + map.error().message};
  return map;
}

Result<ElevationMap> ElevationMap::from_tiles(const std::vector<ElevationTile>& tiles) {
  if (tiles.empty()) return Error{"a map needs at least one tile"};
  const ElevationTile& first = tiles.front();
  ElevationMap map;
  map.datum_ = first.datum;
  map.bias_sigma_m_ = first.bias_sigma_m;
  map.bias_correlation_m_ = first.bias_correlation_m;
  map.cell_m_ = first.cell_m;

  Vec2 low = first.origin_world_m;
  Vec2 high = low;
  for (const ElevationTile& tile : tiles) {
    const Outcome checked = check_tile(tile);
    if (!checked) return Error{"tile " + std::to_string(tile.id) + ": " + checked.error().message};
    if (!same_survey(tile, first)) {
      return Error{"tile " + std::to_string(tile.id) + ": datum, cell or bias differ from tile " +
                   std::to_string(first.id)};
    }
    low = low.cwiseMin(tile.origin_world_m);
    high = high.cwiseMax(tile.origin_world_m + first.cell_m * Vec2(tile.width, tile.height));
  }
  const Vec2 size = (high - low) / first.cell_m;
  const std::int64_t width = std::llround(size.x());
  const std::int64_t height = std::llround(size.y());
  if (width > kMaxNodes || height > kMaxNodes || width * height > kMaxNodes) {
    return Error{"the tiles span " + std::to_string(width) + " x " + std::to_string(height) +
                 " cells, at most " + std::to_string(kMaxNodes) + " in all are allowed"};
  }
  map.origin_world_m_ = low;
  map.width_ = static_cast<int>(width);
  map.height_ = static_cast<int>(height);
  map.nodes_.assign(static_cast<std::size_t>(width * height),
                    {std::numeric_limits<float>::quiet_NaN(), 0.0F, 0});
  for (const ElevationTile& tile : tiles) {
    const Outcome pasted = map.paste(tile, static_cast<int>(map.tile_ids_.size()));
    if (!pasted) return pasted.error();
    map.tile_ids_.push_back(tile.id);
  }
  return map;
}

Outcome ElevationMap::paste(const ElevationTile& tile, int index) {
  std::int64_t di = 0;
  std::int64_t dj = 0;
  if (!lattice_offset(tile.origin_world_m.x(), origin_world_m_.x(), cell_m_, &di) ||
      !lattice_offset(tile.origin_world_m.y(), origin_world_m_.y(), cell_m_, &dj)) {
    return Error{"tile " + std::to_string(tile.id) + " is not on the lattice of the others"};
  }
  std::size_t from = 0;
  for (int j = 0; j < tile.height; ++j) {
    std::size_t to = static_cast<std::size_t>((dj + j) * width_ + di);
    for (int i = 0; i < tile.width; ++i, ++from, ++to) {
      const float z = tile.z_world_m[from];
      if (std::isnan(z)) continue;
      const float sigma =
          tile.cell_sigma_m.empty() ? static_cast<float>(tile.sigma_m) : tile.cell_sigma_m[from];
      nodes_[to] = {z, sigma, index};
    }
  }
  return Done{};
}

bool ElevationMap::sample(double x_m, double y_m, Elevation* out) const {
  const double u = (x_m - origin_world_m_.x()) / cell_m_ - 0.5;
  const double v = (y_m - origin_world_m_.y()) / cell_m_ - 0.5;
  // Also false for NaN. The last node belongs to the map: a one-cell map is still outside.
  if (!(u >= 0.0 && v >= 0.0 && u <= width_ - 1 && v <= height_ - 1)) return false;
  if (width_ < 2 || height_ < 2) return false;
  const int i = std::min(static_cast<int>(u), width_ - 2);
  const int j = std::min(static_cast<int>(v), height_ - 2);
  const double s = u - i;
  const double t = v - j;
  const std::size_t at =
      static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i);
  const Node* south = &nodes_[at];
  const Node* north = south + width_;
  const double z00 = south[0].z_m;
  const double z10 = south[1].z_m;
  const double z01 = north[0].z_m;
  const double z11 = north[1].z_m;
  const double z_south = z00 + s * (z10 - z00);
  const double z_north = z01 + s * (z11 - z01);
  const double z = z_south + t * (z_north - z_south);
  if (std::isnan(z)) return false;  // one unknown node makes the sum NaN, whatever its weight
  out->z_m = z;
  out->gradient = Vec2((z10 - z00) + t * ((z11 - z01) - (z10 - z00)), z_north - z_south) / cell_m_;
  // The mean, not the root of squares: neighbouring cells of a survey err together.
  const double sigma_south = south[0].sigma_m + s * (south[1].sigma_m - south[0].sigma_m);
  const double sigma_north = north[0].sigma_m + s * (north[1].sigma_m - north[0].sigma_m);
  out->sigma_m = sigma_south + t * (sigma_north - sigma_south);
  const Node& nearest = (t < 0.5 ? south : north)[s < 0.5 ? 0 : 1];
  out->tile_id = tile_ids_[static_cast<std::size_t>(nearest.tile)];
  return true;
}

Cell ElevationMap::cell_at(double x_m, double y_m) const {
  return {static_cast<int>(std::floor((x_m - origin_world_m_.x()) / cell_m_)),
          static_cast<int>(std::floor((y_m - origin_world_m_.y()) / cell_m_))};
}

}  // namespace rcs
