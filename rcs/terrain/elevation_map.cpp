#include "rcs/terrain/elevation_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"

namespace rcs {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kMegabyte = 1048576.0;

int wrap(int i, int n) {
  const int r = i % n;
  return r < 0 ? r + n : r;
}

/// Index of a cell in its tile.
std::size_t node_of(Cell cell) {
  constexpr int kMask = kTileSide - 1;
  return static_cast<std::size_t>(cell.j & kMask) * kTileSide +
         static_cast<std::size_t>(cell.i & kMask);
}

struct Span {
  Cell low, high;  // both within
  [[nodiscard]] int wide() const { return high.i - low.i + 1; }
  [[nodiscard]] int high_side() const { return high.j - low.j + 1; }
  void take(Cell c) {
    low = {std::min(low.i, c.i), std::min(low.j, c.j)};
    high = {std::max(high.i, c.i), std::max(high.j, c.j)};
  }
};

Span span_of(const std::vector<MapTileEntry>& tiles) {
  Span s{tiles.front().tile, tiles.front().tile};
  for (const MapTileEntry& e : tiles) s.take(e.tile);
  return s;
}

}  // namespace

ElevationMap::Slot& ElevationMap::Level::slot(Cell tile) {
  return slots[static_cast<std::size_t>(wrap(tile.j, high)) * static_cast<std::size_t>(wide) +
               static_cast<std::size_t>(wrap(tile.i, wide))];
}

double ElevationMap::Level::slot_bytes() const {
  return static_cast<double>(kTileCells * sizeof(TileNode) + max_points * kSurfacePointInMemory);
}

const ElevationMap::Slot* ElevationMap::Level::ready(Cell tile) const {
  const Slot& s =
      slots[static_cast<std::size_t>(wrap(tile.j, high)) * static_cast<std::size_t>(wide) +
            static_cast<std::size_t>(wrap(tile.i, wide))];
  return s.state == Slot::State::kReady && s.tile == tile ? &s : nullptr;
}

const TileNode* ElevationMap::Level::node(Cell cell) const {
  const Slot* s = ready(tile_of(cell));
  return s == nullptr ? nullptr : &s->nodes[node_of(cell)];
}

void ElevationMap::make_slots(Level* level, int wide, int high) {
  level->wide = wide;
  level->high = high;
  level->slots.resize(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high));
  for (Slot& s : level->slots) s.nodes.resize(kTileCells);
}

Result<ElevationMap> ElevationMap::open(const std::string& path, const MapWindow& window) {
  const Result<MapFolder> folder = MapFolder::open(path);
  if (!folder) return folder.error();
  ElevationMap map;
  map.frame_ = folder->index().frame;
  map.path_ = path;
  map.radius_m_ = window.radius_m;
  double bytes = 0.0;
  std::vector<std::pair<int, int>> sides;
  for (const MapLevelIndex& index : folder->index().levels) {
    if (index.tiles.empty()) continue;
    Level level;
    level.index = index;
    level.lattice = lattice_id(map.frame_, index.level);
    const Span span = span_of(index.tiles);
    // The most tiles that the bounding square of a disc can touch.
    const double touched = 2.0 * window.radius_m / (index.level.cell_m * kTileSide);
    const int most = static_cast<int>(std::min(touched, 1e6)) + 2;
    sides.emplace_back(std::min(most, span.wide()), std::min(most, span.high_side()));
    for (const MapTileEntry& e : index.tiles) {
      level.max_points = std::max<std::size_t>(level.max_points, e.points);
    }
    bytes += level.slot_bytes() * sides.back().first * sides.back().second;
    map.levels_.push_back(std::move(level));
  }
  if (map.levels_.empty()) return Error{path + ": a map without tiles"};
  if (bytes > window.memory_bytes) {
    return Error{path + ": " + std::to_string(std::lround(bytes / kMegabyte)) +
                 " MB are needed around the vehicle, " +
                 std::to_string(std::lround(window.memory_bytes / kMegabyte)) + " allowed"};
  }
  for (std::size_t k = 0; k < sides.size(); ++k) {
    map.make_slots(&map.levels_[k], sides[k].first, sides[k].second);
  }
  return map;
}

Result<ElevationMap> ElevationMap::load(const std::string& path, double memory_bytes) {
  MapWindow all;
  all.radius_m = 1e9;
  all.memory_bytes = memory_bytes;
  Result<ElevationMap> map = open(path, all);
  if (!map) return map;
  DirectTileLoader loader(path);
  for (std::size_t k = 0; k < map->levels_.size(); ++k) {
    for (const MapTileEntry& entry : map->levels_[k].index.tiles) {
      RCS_CHECK(map->start(k, entry, &loader));
      if (map->loading_.failed > 0) return Error{map->loading_.failure};
    }
  }
  return map;
}

Result<ElevationMap> ElevationMap::from_rasters(const MapFrame& frame,
                                                const std::vector<Raster>& rasters) {
  constexpr double kMaxBytes = 4e9;
  if (rasters.empty()) return Error{"a map needs at least one raster"};
  ElevationMap map;
  map.frame_ = frame;
  std::vector<Span> spans;
  for (const Raster& r : rasters) {
    if (Outcome checked = check_raster(r); !checked) return checked.error();
    const Cell low = tile_of(r.first);
    const Cell high = tile_of({r.first.i + r.width - 1, r.first.j + r.height - 1});
    std::size_t k = 0;
    while (k < map.levels_.size() && !(map.levels_[k].index.level == r.level)) ++k;
    if (k == map.levels_.size()) {
      Level level;
      level.index.level = r.level;
      map.levels_.push_back(std::move(level));
      spans.push_back({low, high});
    }
    spans[k].take(low);
    spans[k].take(high);
  }
  double bytes = 0.0;
  for (std::size_t k = 0; k < spans.size(); ++k) {
    bytes += map.levels_[k].slot_bytes() * spans[k].wide() * spans[k].high_side();
  }
  if (bytes > kMaxBytes) return Error{"the rasters are too far apart for one map in memory"};
  for (std::size_t k = 0; k < spans.size(); ++k) {
    Level& level = map.levels_[k];
    map.make_slots(&level, spans[k].wide(), spans[k].high_side());
    for (int j = spans[k].low.j; j <= spans[k].high.j; ++j) {
      for (int i = spans[k].low.i; i <= spans[k].high.i; ++i) {
        Slot& slot = level.slot({i, j});
        slot.tile = {i, j};
        slot.state = Slot::State::kReady;
        std::fill(slot.nodes.begin(), slot.nodes.end(), TileNode{kUnknown, 1.0F});
        std::vector<SurfacePoint> points;
        for (const Raster& r : rasters) {
          if (!(r.level == level.index.level) || r.points.empty()) continue;
          const Raster tile = cut(r, first_cell({i, j}), kTileSide, kTileSide);
          points.insert(points.end(), tile.points.begin(), tile.points.end());
        }
        slot.points.load(points);
        level.max_points = std::max(level.max_points, points.size());
      }
    }
    for (const Raster& r : rasters) {
      if (!(r.level == level.index.level)) continue;
      for (int j = r.first.j; j < r.first.j + r.height; ++j) {
        for (int i = r.first.i; i < r.first.i + r.width; ++i) {
          const std::size_t from = r.at({i, j});
          if (std::isnan(r.z_m[from])) continue;
          level.slot(tile_of({i, j})).nodes[node_of({i, j})] = {r.z_m[from],
                                                                layer_at(r.sigma_m, from)};
        }
      }
    }
  }
  std::sort(map.levels_.begin(), map.levels_.end(), [](const Level& a, const Level& b) {
    return a.index.level.cell_m < b.index.level.cell_m;
  });
  return map;
}

std::size_t ElevationMap::memory_bytes() const {
  double bytes = 0.0;
  for (const Level& level : levels_) {
    bytes += level.slot_bytes() * static_cast<double>(level.slots.size());
  }
  return static_cast<std::size_t>(bytes);
}

bool ElevationMap::has_points() const {
  return std::any_of(levels_.begin(), levels_.end(),
                     [](const Level& level) { return level.max_points > 0; });
}

bool ElevationMap::closest_point(const Vec3& p, double distance_m, StandingHere* out) const {
  constexpr double kFarthest_m = 1e6;
  if (!(p.head<2>().cwiseAbs().maxCoeff() < kFarthest_m)) return false;  // NaN, too
  bool found = false;
  for (const Level& level : levels_) {
    if (level.max_points == 0) continue;
    const MapLevel& l = level.index.level;
    const Cell low = tile_of(l.cell_at(p.x() - distance_m, p.y() - distance_m));
    const Cell high = tile_of(l.cell_at(p.x() + distance_m, p.y() + distance_m));
    for (int j = low.j; j <= high.j; ++j) {
      for (int i = low.i; i <= high.i; ++i) {
        const Slot* slot = level.ready({i, j});
        if (slot == nullptr) continue;
        const Vec2 corner_m = l.origin_m + l.cell_m * kTileSide * Vec2(i, j);
        const Vec3 corner(corner_m.x(), corner_m.y(), 0.0);
        const SurfacePoint* at =
            slot->points.closest_within((p - corner).cast<float>(), static_cast<float>(distance_m));
        if (at == nullptr) continue;
        *out = {corner + at->p_m.cast<double>(), at->normal.cast<double>(), at->sigma_m};
        distance_m = (p - out->p_m).norm();
        found = true;
      }
    }
  }
  return found;
}

bool ElevationMap::sample(double x_m, double y_m, Elevation* out, int finest) const {
  for (int k = finest; k < levels(); ++k) {
    if (sample_level(k, x_m, y_m, out)) return true;
  }
  return false;
}

bool ElevationMap::sample_level(int number, double x_m, double y_m, Elevation* out) const {
  const Level& level = levels_[static_cast<std::size_t>(number)];
  const double cell_m = level.index.level.cell_m;
  const double u = (x_m - level.index.level.origin_m.x()) / cell_m - 0.5;
  const double v = (y_m - level.index.level.origin_m.y()) / cell_m - 0.5;
  constexpr double kFarthest = 1e9;
  if (!(std::abs(u) < kFarthest && std::abs(v) < kFarthest)) return false;  // NaN, too
  const Cell c{static_cast<int>(std::floor(u)), static_cast<int>(std::floor(v))};
  const TileNode* n00 = level.node(c);
  if (n00 == nullptr) return false;
  constexpr int kMask = kTileSide - 1;
  const bool inside = (c.i & kMask) != kMask && (c.j & kMask) != kMask;
  const TileNode* n10 = inside ? n00 + 1 : level.node({c.i + 1, c.j});
  const TileNode* n01 = inside ? n00 + kTileSide : level.node({c.i, c.j + 1});
  const TileNode* n11 = inside ? n01 + 1 : level.node({c.i + 1, c.j + 1});
  if (n10 == nullptr || n01 == nullptr || n11 == nullptr) return false;
  const double s = u - c.i;
  const double t = v - c.j;
  const double z00 = n00->z_m;
  const double z10 = n10->z_m;
  const double z01 = n01->z_m;
  const double z11 = n11->z_m;
  const double z_south = z00 + s * (z10 - z00);
  const double z_north = z01 + s * (z11 - z01);
  const double z = z_south + t * (z_north - z_south);
  if (std::isnan(z)) return false;  // one unknown node makes the sum NaN, for any weight
  out->z_m = z;
  out->gradient = Vec2((z10 - z00) + t * ((z11 - z01) - (z10 - z00)), z_north - z_south) / cell_m;
  // The mean, not the root of squares: errors of neighbouring cells of a survey are correlated.
  const double sigma_south = n00->sigma_m + s * (n10->sigma_m - n00->sigma_m);
  const double sigma_north = n01->sigma_m + s * (n11->sigma_m - n01->sigma_m);
  out->sigma_m = sigma_south + t * (sigma_north - sigma_south);
  out->level = number;
  out->cell = {c.i + (s < 0.5 ? 0 : 1), c.j + (t < 0.5 ? 0 : 1)};
  out->tile_id = tile_id(number, tile_of(out->cell));
  return true;
}

void ElevationMap::follow(const Vec2& place_m, TileLoader* loader) {
  TileJob job;
  while (loader->finished(&job)) take(job);
  wanted_ = 0;
  // Coarse levels first: they have few tiles and substitute for finer ones still being loaded.
  for (std::size_t k = levels_.size(); k-- > 0;) want(k, place_m, loader);
}

void ElevationMap::want(std::size_t number, const Vec2& place_m, TileLoader* loader) {
  Level& level = levels_[number];
  if (level.index.tiles.empty()) return;
  const double side_m = level.index.level.cell_m * kTileSide;
  const Vec2 here = (place_m - level.index.level.origin_m) / side_m;
  const double radius = radius_m_ / side_m;
  constexpr double kFarthest = 1e9;  // tiles; rejects a belief that is not finite, too
  if (!(std::abs(here.x()) < kFarthest && std::abs(here.y()) < kFarthest)) return;
  const Cell low{static_cast<int>(std::floor(here.x() - radius)),
                 static_cast<int>(std::floor(here.y() - radius))};
  // A window has few tiles: searching the nearest missing one again and again is cheap.
  while (true) {
    const MapTileEntry* nearest = nullptr;
    double nearest_at = radius;
    int missing = 0;
    for (int j = low.j; j <= here.y() + radius; ++j) {
      for (int i = low.i; i <= here.x() + radius; ++i) {
        const Vec2 corner(i, j);
        const double at = (here - here.cwiseMax(corner).cwiseMin(corner + Vec2::Ones())).norm();
        const MapTileEntry* entry = level.index.find({i, j});
        if (entry == nullptr || at > radius) continue;
        const Slot& slot = level.slot(entry->tile);
        const bool loading = slot.state == Slot::State::kLoading;
        if (slot.tile == entry->tile && slot.state != Slot::State::kEmpty) {
          missing += loading ? 1 : 0;
          continue;
        }
        ++missing;
        if (loading) continue;  // its former tile is still being loaded
        if (nearest == nullptr || at < nearest_at) {
          nearest = entry;
          nearest_at = at;
        }
      }
    }
    if (nearest == nullptr || !start(number, *nearest, loader)) {
      wanted_ += missing;
      return;
    }
  }
}

bool ElevationMap::start(std::size_t number, const MapTileEntry& entry, TileLoader* loader) {
  Level& level = levels_[number];
  Slot& slot = level.slot(entry.tile);
  TileJob job;
  job.level = static_cast<int>(number);
  job.tile = entry.tile;
  job.lattice = level.lattice;
  job.checksum = entry.checksum;
  job.cell_m = level.index.level.cell_m;
  job.nodes = slot.nodes.data();
  job.points = &slot.points;
  job.max_points = level.max_points;
  if (!loader->start(job)) return false;
  slot.tile = entry.tile;
  slot.state = Slot::State::kLoading;
  while (loader->finished(&job)) take(job);
  return true;
}

void ElevationMap::take(const TileJob& job) {
  Slot& slot = levels_[static_cast<std::size_t>(job.level)].slot(job.tile);
  RCS_CHECK(slot.state == Slot::State::kLoading && slot.tile == job.tile);
  if (!job.failure.empty()) {
    slot.state = Slot::State::kFailed;
    ++loading_.failed;
    loading_.failure = job.failure;
    return;
  }
  slot.state = Slot::State::kReady;
  ++loading_.loaded;
}

}  // namespace rcs
