#include "tools/mapping/resample.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mapping {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kFarthest_m = 1e6;  // between datums

struct Place {
  double z_m = 0.0;  // of the surface, in the frame of its raster
  double sigma_m = 0.0;
  std::size_t nearest = 0;  // cell
};

/// @return false if a node with a weight is unknown
bool sample(const Raster& r, const Vec2& p, Place* out) {
  constexpr double kOnNode = 1e-6;  // cells: positions this near to a node need no neighbour
  constexpr double kFarthest = 1e9;
  const Vec2 at = (p - r.level.origin_m) / r.level.cell_m - Vec2::Constant(0.5);
  if (!(at.cwiseAbs().maxCoeff() < kFarthest)) return false;
  Vec2 low = (at + Vec2::Constant(kOnNode)).array().floor();
  Vec2 share = at - low;
  for (int a = 0; a < 2; ++a) {
    if (share[a] < kOnNode) share[a] = 0.0;
  }
  const Cell c{static_cast<int>(low.x()), static_cast<int>(low.y())};
  double z = 0.0;
  double sigma = 0.0;
  double most = 0.0;
  for (int k = 0; k < 4; ++k) {
    const int i = k % 2;
    const int j = k / 2;
    const double w =
        (i == 1 ? share.x() : 1.0 - share.x()) * (j == 1 ? share.y() : 1.0 - share.y());
    if (w == 0.0) continue;
    const Cell node{c.i + i, c.j + j};
    if (!r.contains(node)) return false;
    const std::size_t n = r.at(node);
    z += w * r.z_m[n];
    // The mean, not the root mean square: errors of neighbouring cells are correlated.
    sigma += w * layer_at(r.sigma_m, n);
    if (w > most) {
      most = w;
      out->nearest = n;
    }
  }
  if (std::isnan(z)) return false;
  out->z_m = z;
  out->sigma_m = sigma;
  return true;
}

/// The z of frame b over (x, y) at which z of frame a has a value.
double z_where(const Pose& T_a_b, const Mat3& R_a_b, const Vec2& p_b, double z_a) {
  return (z_a - T_a_b.p.z() - R_a_b(2, 0) * p_b.x() - R_a_b(2, 1) * p_b.y()) / R_a_b(2, 2);
}

/// Intersections of the verticals of another frame with the surface of a raster.
class Surface {
 public:
  Surface(const Raster& raster, const Pose& T_raster_frame)
      : raster_(raster), T_(T_raster_frame), R_(T_raster_frame.rotation()) {
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
    for (const float z : raster.z_m) {
      if (std::isnan(z)) continue;
      low = std::min(low, z);
      high = std::max(high, z);
    }
    known_ = low <= high;
    middle_m_ = 0.5 * (static_cast<double>(low) + high);
  }
  [[nodiscard]] bool known() const { return known_; }

  /// @param z_m  of the frame
  [[nodiscard]] bool meet(const Vec2& p, double* z_m, Place* place) const {
    // An error of z shifts the position by the tilt (1e-2 for datums 60 km apart), and the height
    // by the slope times that shift: each iteration reduces the error by a factor of at least 100.
    constexpr int kRounds = 5;
    constexpr double kEnough_m = 1e-5;
    double z = z_where(T_, R_, p, middle_m_);
    for (int round = 0; round < kRounds; ++round) {
      const Vec3 at = T_ * Vec3(p.x(), p.y(), z);
      if (!sample(raster_, at.head<2>(), place)) return false;
      const double step = (place->z_m - at.z()) / R_(2, 2);
      z += step;
      if (std::abs(step) < kEnough_m) break;
    }
    *z_m = z;
    return true;
  }

 private:
  const Raster& raster_;
  Pose T_;
  Mat3 R_;
  bool known_ = false;
  double middle_m_ = 0.0;
};

/// Sigma is at least the difference of the centre of a cell to the mean of its corners, root mean
/// square over 3 x 3 cells: the interpolation error between nodes.
void widen(const Surface& surface, Raster* r) {
  const auto wide = static_cast<std::size_t>(r->width) + 1;
  std::vector<float> corner;
  corner.reserve(wide * (static_cast<std::size_t>(r->height) + 1));
  for (int j = 0; j <= r->height; ++j) {
    for (int i = 0; i <= r->width; ++i) {
      const Vec2 p = r->level.origin_m + r->level.cell_m * Vec2(r->first.i + i, r->first.j + j);
      double z = 0.0;
      Place place;
      corner.push_back(surface.meet(p, &z, &place) ? static_cast<float>(z) : kUnknown);
    }
  }
  std::vector<float> square(r->cells(), kUnknown);
  const auto width = static_cast<std::size_t>(r->width);
  for (std::size_t k = 0; k < square.size(); ++k) {
    const float* south = &corner[k / width * wide + k % width];
    const float* north = south + wide;
    const float miss = r->z_m[k] - 0.25F * (south[0] + south[1] + north[0] + north[1]);
    square[k] = miss * miss;
  }
  for (int j = 0; j < r->height; ++j) {
    for (int i = 0; i < r->width; ++i) {
      double sum = 0.0;
      int count = 0;
      for (int b = std::max(0, j - 1); b <= std::min(r->height - 1, j + 1); ++b) {
        for (int a = std::max(0, i - 1); a <= std::min(r->width - 1, i + 1); ++a) {
          const float s = square[r->at({r->first.i + a, r->first.j + b})];
          if (std::isnan(s)) continue;
          sum += s;
          ++count;
        }
      }
      if (count == 0) continue;
      float& sigma = r->sigma_m[r->at({r->first.i + i, r->first.j + j})];
      sigma = std::max(sigma, static_cast<float>(std::sqrt(sum / count)));
    }
  }
}

}  // namespace

Raster resample(const Raster& from, const Pose& T_from_to, const MapLevel& to, Cell first,
                int width, int height) {
  Raster r;
  r.level = from.level;
  r.level.cell_m = to.cell_m;
  r.level.origin_m = to.origin_m;
  r.first = first;
  r.width = width;
  r.height = height;
  const std::size_t n = r.cells();
  r.z_m.assign(n, kUnknown);
  r.sigma_m.assign(n, 1.0F);
  r.count.assign(n, 0);
  r.date.assign(n, 0);
  r.source.assign(n, CellSource::kUnknown);
  const Surface surface(from, T_from_to);
  if (!surface.known()) return r;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const Cell c{first.i + i, first.j + j};
      double z = 0.0;
      Place place;
      if (!surface.meet(to.centre(c), &z, &place)) continue;
      const std::size_t k = r.at(c);
      r.z_m[k] = static_cast<float>(z);
      r.sigma_m[k] = static_cast<float>(place.sigma_m);
      r.count[k] = layer_at(from.count, place.nearest);
      r.date[k] = layer_at(from.date, place.nearest);
      r.source[k] = layer_at(from.source, place.nearest);
    }
  }
  if (from.level.cell_m < to.cell_m) widen(surface, &r);
  return r;
}

MapResampler::MapResampler(MapFolder map, std::size_t level, const Pose& T_map_like)
    : map_(std::move(map)), level_(level), T_map_like_(T_map_like) {
  for (const MapTileEntry& e : tiles().tiles) {
    low_m_ = std::min(low_m_, e.low_m);
    high_m_ = std::max(high_m_, e.high_m);
  }
}

Result<MapResampler> MapResampler::open(const std::string& path, const MapFolder& like,
                                        double cell_m) {
  Result<MapFolder> map = MapFolder::open(path);
  if (!map) return map.error();
  const MapFrame& f = map->index().frame;
  const MapFrame& g = like.index().frame;
  if (f.reference != g.reference) {
    return Error{path + " is in " + f.reference + ", " + like.path() + " in " + g.reference +
                 ": both must be in one reference frame"};
  }
  if (f.heights != g.heights) {
    return Error{path + " has heights above " + f.heights + ", " + like.path() + " above " +
                 g.heights + ": both must be above the same"};
  }
  Pose T_map_like;
  if (f.datum.lat_rad != g.datum.lat_rad || f.datum.lon_rad != g.datum.lon_rad ||
      f.datum.height.m != g.datum.height.m) {
    T_map_like = LocalFrame(f.datum).from(LocalFrame(g.datum));
  }
  if (!(T_map_like.p.norm() <= kFarthest_m)) {
    return Error{path + " and " + like.path() + " have datums " +
                 std::to_string(std::lround(T_map_like.p.norm() / 1000.0)) +
                 " km apart, allowed are 1000 km"};
  }
  constexpr double kRounding = 1.0 + 1e-9;
  std::size_t level = 0;
  const std::vector<MapLevelIndex>& levels = map->index().levels;
  while (level + 1 < levels.size() && levels[level + 1].level.cell_m <= cell_m * kRounding) ++level;
  return MapResampler(std::move(map).value(), level, T_map_like);
}

std::vector<std::pair<Cell, Cell>> MapResampler::reaches(const MapLevel& to) const {
  const Pose T_like_map = T_map_like_.inverse();
  const double side_m = level().cell_m * kTileSide;
  std::vector<std::pair<Cell, Cell>> spans;
  for (const MapTileEntry& e : tiles().tiles) {
    Vec2 low = Vec2::Constant(std::numeric_limits<double>::max());
    Vec2 high = -low;
    for (int k = 0; k < 8; ++k) {
      const Vec2 p = level().origin_m + side_m * Vec2(e.tile.i + k % 2, e.tile.j + k / 2 % 2);
      const double z = k < 4 ? e.low_m : e.high_m;
      const Vec2 at = (T_like_map * Vec3(p.x(), p.y(), z)).head<2>();
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    // Nodes are at the centres of cells: borders of cells are never requested.
    const Vec2 inside = Vec2::Constant(1e-6 * level().cell_m);
    low += inside;
    high -= inside;
    spans.emplace_back(tile_of(to.cell_at(low.x(), low.y())),
                       tile_of(to.cell_at(high.x(), high.y())));
  }
  return spans;
}

Result<Raster> MapResampler::read(const MapLevel& to, Cell first, int width, int height) {
  // Margin around the request: one cell for its corners, two of the map for interpolation.
  const Vec2 corner = to.origin_m + to.cell_m * Vec2(first.i - 1, first.j - 1);
  const Vec2 size = to.cell_m * Vec2(width + 2, height + 2);
  if (low_m_ > high_m_) {
    window_ = Raster();
    return resample(window_, T_map_like_, to, first, width, height);
  }
  const Mat3 R = T_map_like_.rotation();
  Vec2 low = Vec2::Constant(std::numeric_limits<double>::max());
  Vec2 high = -low;
  for (int k = 0; k < 8; ++k) {
    const Vec2 p = corner + Vec2(k % 2 * size.x(), k / 2 % 2 * size.y());
    const double z = z_where(T_map_like_, R, p, k < 4 ? low_m_ : high_m_);
    const Vec2 at = (T_map_like_ * Vec3(p.x(), p.y(), z)).head<2>();
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  const Vec2 around = Vec2::Constant(2.0 * level().cell_m);
  low -= around;
  high += around;
  const Outcome brought = bring(tile_of(level().cell_at(low.x(), low.y())),
                                tile_of(level().cell_at(high.x(), high.y())));
  if (!brought) return brought.error();
  return resample(window_, T_map_like_, to, first, width, height);
}

Outcome MapResampler::bring(Cell low_tile, Cell high_tile) {
  const Cell first = first_cell(low_tile);
  const int width = (high_tile.i - low_tile.i + 1) * kTileSide;
  const int height = (high_tile.j - low_tile.j + 1) * kTileSide;
  if (window_.first == first && window_.width == width && window_.height == height) return Done{};
  window_ = Raster();  // no partial window remains after an error
  Raster w;
  w.level = level();
  w.first = first;
  w.width = width;
  w.height = height;
  const std::size_t n = w.cells();
  w.z_m.assign(n, kUnknown);
  w.sigma_m.assign(n, 1.0F);
  w.count.assign(n, 0);
  w.date.assign(n, 0);
  w.source.assign(n, CellSource::kUnknown);
  for (int tj = low_tile.j; tj <= high_tile.j; ++tj) {
    for (int ti = low_tile.i; ti <= high_tile.i; ++ti) {
      if (tiles().find({ti, tj}) == nullptr) continue;
      const Result<Raster> tile = map_.read(static_cast<int>(level_), {ti, tj}, &buffer_);
      if (!tile) return tile.error();
      for (std::size_t k = 0; k < kTileCells; ++k) {
        const std::size_t to = w.at({tile->first.i + static_cast<int>(k) % kTileSide,
                                     tile->first.j + static_cast<int>(k) / kTileSide});
        w.z_m[to] = tile->z_m[k];
        w.sigma_m[to] = layer_at(tile->sigma_m, k);
        w.count[to] = layer_at(tile->count, k);
        w.date[to] = layer_at(tile->date, k);
        w.source[to] = layer_at(tile->source, k);
      }
    }
  }
  window_ = std::move(w);
  return Done{};
}

}  // namespace rcs::mapping
