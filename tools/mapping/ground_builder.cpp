#include "tools/mapping/ground_builder.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mapping {
namespace {

constexpr int kWeight = 16;  // of a return with sigma near_sigma_m
constexpr double kAbove_m = 0.3;
constexpr double kMinGround = 0.5;  // probability above which a return is ground

double median(std::vector<float>* v) {
  if (v->empty()) return 0.0;
  const auto middle = v->begin() + static_cast<std::ptrdiff_t>(v->size() / 2);
  std::nth_element(v->begin(), middle, v->end());
  return static_cast<double>(*middle);
}

/// Cell number k of a block.
constexpr int kBlockSide = CellBlocks<int>::kSide;
constexpr int kPlaces = kBlockSide * kBlockSide;
Cell cell_of(Cell first, int k) { return {first.i + k % kBlockSide, first.j + k / kBlockSide}; }

}  // namespace

Cell GroundBuilder::cell_at(const Vec3& p) const {
  return {static_cast<int>(std::floor(p.x() / params_.cell_m)),
          static_cast<int>(std::floor(p.y() / params_.cell_m))};
}

Vec2 GroundBuilder::centre(Cell c) const { return params_.cell_m * Vec2(c.i + 0.5, c.j + 0.5); }

void GroundBuilder::count(const Vec3& p, double range_m) {
  const std::optional<GroundHere> here = surface_->at(p.x(), p.y());
  if (!here) return;
  const double ratio = params_.near_sigma_m / height_sigma(params_, range_m);
  const int weight = std::max(1, static_cast<int>(std::lround(kWeight * ratio * ratio)));
  counts_.at(cell_at(p)).add(p.z() - here->z_m, weight);
}

void GroundBuilder::settle() {
  constexpr double kMin = 3.0;
  constexpr int kMinReturns = 3;
  counts_.for_each([this](Cell c, const HeightCounts& own) {
    if (own.returns == 0) return;
    std::array<double, HeightCounts::kLayers> pool{};
    int returns = 0;
    for (int k = 0; k < 9; ++k) {
      const HeightCounts* n = counts_.find({c.i + k % 3 - 1, c.j + k / 3 - 1});
      if (n == nullptr) continue;
      returns += n->returns;
      for (std::size_t a = 0; a < pool.size(); ++a) pool[a] += n->weight[a];
    }
    if (returns < kMinReturns) return;
    const std::optional<GroundLayer> layer = find_ground(pool, kMin);
    if (!layer) return;
    CellStatistics& place = places_.at(c);
    place.known = true;
    place.layer = *layer;
    place.pool_m = layer->above_m;
    place.pool_returns = returns;
    // The height of the cell, between its returns and those of its neighbours.
    double precision = 1.0 / (params_.neighbour_m * params_.neighbour_m);
    double mean = 0.0;
    for (int a = 0; a < HeightCounts::kLayers; ++a) {
      const double z = HeightCounts::middle_m(a);
      const double w = own.weight[static_cast<std::size_t>(a)] * layer->is_ground(z) /
                       (kWeight * layer->sigma_m * layer->sigma_m);
      precision += w;
      mean += w * (z - layer->above_m);
    }
    place.layer.above_m += mean / precision;
  });
  counts_ = {};
  refuse_grown_over();
}

/// In impermeable vegetation the lowest returns are of plants: their standard deviation is larger
/// than that of bare ground with the same LADAR and poses.
void GroundBuilder::refuse_grown_over() {
  constexpr double kBare = 0.9;
  std::vector<float> bare;
  std::vector<float> all;
  places_.for_each([&](Cell, const CellStatistics& p) {
    if (!p.known) return;
    all.push_back(static_cast<float>(p.layer.sigma_m));
    if (p.layer.share > kBare) bare.push_back(static_cast<float>(p.layer.sigma_m));
  });
  constexpr std::size_t kEnough = 100;
  bare_sigma_m_ = median(bare.size() < kEnough ? &all : &bare);
  constexpr double kMin_m = 0.025;
  const double max_m = std::max(kMin_m, 2.0 * bare_sigma_m_);
  for (const Cell first : places_.blocks()) {
    for (int k = 0; k < kPlaces; ++k) {
      CellStatistics& p = places_.at(cell_of(first, k));
      if (!p.known || p.layer.sigma_m <= max_m) continue;
      p.known = false;
      ++metrics_.vegetated;
    }
  }
}

void GroundBuilder::measure(const Vec3& p, double range_m, Stamp stamp, std::uint32_t scan) {
  const std::optional<GroundHere> here = surface_->at(p.x(), p.y());
  CellStatistics* place = here ? places_.find(cell_at(p)) : nullptr;
  if (place == nullptr || !place->known) {
    ++metrics_.without_ground;
    return;
  }
  const std::int64_t look = to_utime(stamp) / params_.look.count();
  if (look != place->look) {
    end_observation(place);
    place->look = look;
  }
  place->look_counts = true;
  const double z = p.z() - here->z_m;
  const double ground = place->layer.is_ground(z);
  if (z > place->layer.above_m + kAbove_m) {
    place->look_above = true;
    ++place->above;
  }
  if (ground < kMinGround) {
    if (z <= place->layer.above_m + kAbove_m) ++metrics_.above_ground;
    return;
  }
  ++metrics_.ground;
  const double sigma_m = height_sigma(params_, range_m);
  const double w = ground / (sigma_m * sigma_m);
  place->look_w += static_cast<float>(w);
  place->look_wz += static_cast<float>(w * z);
  if (place->scans == 0 || place->scan != scan) {
    if (place->scans < 65535) ++place->scans;
    place->scan = scan;
  }
}

void GroundBuilder::end_observation(CellStatistics* p) const {
  if (!p->look_counts) return;
  constexpr int kMax = 65535;
  if (p->looks < kMax) ++p->looks;
  if (p->look_above && p->looks_above < kMax) ++p->looks_above;
  if (p->look_w > 0.0F) {
    // Returns of one observation share the error of its pose, which limits their weight.
    const double least = params_.near_sigma_m * params_.near_sigma_m;
    const double w = 1.0 / (1.0 / p->look_w + least);
    const double z = p->look_wz / p->look_w;
    p->w += w;
    p->wz += w * z;
    p->ww += w * w;
    p->wwz += w * w * z;
    p->wwzz += w * w * z * z;
    if (p->looks_ground < kMax) ++p->looks_ground;
  }
  p->look_w = p->look_wz = 0.0F;
  p->look_above = p->look_counts = false;
}

void GroundBuilder::finish() {
  for (const Cell first : places_.blocks()) {
    for (int k = 0; k < kPlaces; ++k) end_observation(&places_.at(cell_of(first, k)));
  }
  find_heights();
  find_sigmas();
}

/// Above-ground structure in few of the observations is transient.
bool GroundBuilder::transient(const CellStatistics& p) {
  constexpr int kLooks = 4;
  constexpr int kFew = 4;  // less than one in so many
  return p.looks_ground >= kLooks && p.looks_above * kFew <= p.looks;
}

bool GroundBuilder::transient(double x_m, double y_m) const {
  const CellStatistics* p = places_.find(cell_at(Vec3(x_m, y_m, 0.0)));
  return p != nullptr && transient(*p);
}

void GroundBuilder::find_heights() {
  for (const Cell first : places_.blocks()) {
    for (int k = 0; k < kPlaces; ++k) {
      const Cell c = cell_of(first, k);
      CellStatistics& p = places_.at(c);
      if (!p.known) continue;
      const Vec2 at = centre(c);
      const std::optional<GroundHere> here = surface_->at(at.x(), at.y());
      p.known = here && p.looks_ground > 0;
      (transient(p) ? metrics_.transient : metrics_.above_ground) += p.above;
      if (!p.known) continue;
      const double prior = 1.0 / (params_.neighbour_m * params_.neighbour_m);
      p.z_m = static_cast<float>(here->z_m + (p.wz + prior * p.pool_m) / (p.w + prior));
    }
  }
}

/// The variance of an observation is estimated from the differences between observations, also of
/// neighbouring cells, because the variance of few observations is uncertain.
void GroundBuilder::find_sigmas() {
  constexpr int kReach = 2;
  constexpr double kPriorLooks = 3.0;
  struct Spread {
    double square = 0.0;  // sum of w^2 (z - mean)^2, unbiased
    double ww = 0.0;
  };
  const auto add = [](const CellStatistics& p, Spread* s) {
    if (!p.known || p.looks_ground < 2) return;
    const double mean = p.wz / p.w;
    const double square = p.wwzz - 2.0 * mean * p.wwz + mean * mean * p.ww;
    const double n = std::max(1.1, p.w * p.w / p.ww);  // effective number of observations
    s->square += std::max(0.0, square) * n / (n - 1.0);
    s->ww += p.ww;
  };
  Spread all;
  places_.for_each([&](Cell, const CellStatistics& p) { add(p, &all); });
  const double standard = params_.near_sigma_m * params_.near_sigma_m;
  const double typical = all.ww > 0.0 ? all.square / all.ww : 4.0 * standard;
  std::vector<float> sigmas;
  std::vector<float> roughness;
  for (const Cell first : places_.blocks()) {
    for (int k = 0; k < kPlaces; ++k) {
      const Cell c = cell_of(first, k);
      CellStatistics& p = places_.at(c);
      if (!p.known) continue;
      Spread s;
      Mat3 A = Vec3(0.0, 1e-3, 1e-3).asDiagonal();
      Vec3 b = Vec3::Zero();
      double square = 0.0;
      int near = 0;
      for (int j = -kReach; j <= kReach; ++j) {
        for (int i = -kReach; i <= kReach; ++i) {
          const CellStatistics* n = places_.find({c.i + i, c.j + j});
          if (n == nullptr || !n->known) continue;
          add(*n, &s);
          if (std::abs(i) > 1 || std::abs(j) > 1) continue;
          const Vec3 row(1.0, i, j);
          const double z = n->z_m - p.z_m;
          A += row * row.transpose();
          b += row * z;
          square += z * z;
          ++near;
        }
      }
      constexpr int kPlane = 3;
      p.roughness_m = 0.0F;
      if (near > kPlane) {
        const Vec3 plane = A.ldlt().solve(b);
        p.roughness_m =
            static_cast<float>(std::sqrt(std::max(0.0, square - plane.dot(b)) / (near - kPlane)));
      }
      // Neighbouring cells share their observations: together they have no more information.
      const double freedom = std::max(0.0, p.w * p.w / p.ww - 1.0);
      const double here = s.ww > 0.0 ? s.square / s.ww : typical;
      const double look = (freedom * here + kPriorLooks * typical) / (freedom + kPriorLooks);
      // Variance of Student's t: the variance of the observations is estimated from few of them.
      const double degrees = freedom + kPriorLooks;
      const double variance = look * p.ww / (p.w * p.w) * degrees / (degrees - 2.0);
      const double prior = params_.neighbour_m * params_.neighbour_m;
      const double own = variance * prior / (variance + prior);
      // Between the centres of cells the ground is about as rough as from cell to cell.
      constexpr double kInside = 1.5;
      const double inside_m = kInside * p.roughness_m;
      // An excess of the variance over that of bare ground is caused by vegetation, which raises
      // the mean. The variance of few returns is uncertain.
      constexpr double kLifts = 0.25;  // of the variance
      constexpr double kFew = 20.0;
      const double layer = p.layer.sigma_m * p.layer.sigma_m * (1.0 + kFew / p.pool_returns);
      const double grown = kLifts * std::max(0.0, layer - bare_sigma_m_ * bare_sigma_m_);
      p.sigma_m = static_cast<float>(std::sqrt(own + inside_m * inside_m + grown));
      sigmas.push_back(p.sigma_m);
      roughness.push_back(p.roughness_m);
      ++metrics_.cells;
      constexpr int kOften = 5;
      if (p.scans >= kOften) ++metrics_.observed_5;
    }
  }
  metrics_.sigma_median_m = median(&sigmas);
  metrics_.roughness_median_m = median(&roughness);
}

std::size_t GroundBuilder::bytes() const { return counts_.bytes() + places_.bytes(); }

std::vector<Cell> GroundBuilder::tiles() const {
  std::vector<Cell> tiles;
  places_.for_each([&](Cell c, const CellStatistics& p) {
    if (!p.known) return;
    const Cell tile = tile_of(c);
    if (tiles.empty() || !(tiles.back() == tile)) tiles.push_back(tile);
  });
  const auto before = [](Cell a, Cell b) { return a.j != b.j ? a.j < b.j : a.i < b.i; };
  std::sort(tiles.begin(), tiles.end(), before);
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

Raster GroundBuilder::tile(const MapLevel& level, Cell tile, std::uint16_t date) const {
  RCS_CHECK(level.cell_m == params_.cell_m && level.origin_m == Vec2::Zero());
  Raster r;
  r.level = level;
  r.first = first_cell(tile);
  r.width = r.height = kTileSide;
  r.z_m.assign(kTileCells, std::numeric_limits<float>::quiet_NaN());
  r.sigma_m.assign(kTileCells, 1.0F);
  r.count.assign(kTileCells, 0);
  r.date = {date};
  r.source = {CellSource::kSensed};
  for (std::size_t k = 0; k < kTileCells; ++k) {
    const Cell c{r.first.i + static_cast<int>(k) % kTileSide,
                 r.first.j + static_cast<int>(k) / kTileSide};
    const CellStatistics* p = places_.find(c);
    if (p == nullptr || !p->known) continue;
    r.z_m[k] = p->z_m;
    r.sigma_m[k] = p->sigma_m;
    r.count[k] = p->scans;
  }
  return r;
}

}  // namespace rcs::mapping
