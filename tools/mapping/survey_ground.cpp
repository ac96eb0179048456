#include "tools/mapping/survey_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "rcs/terrain/map_tile.h"
#include "tools/mapping/bare_earth.h"

namespace rcs::mapping {
namespace {

/// SplitMix64 (Steele, Lea and Flood 2014): the n-th number of the sequence of a cell.
std::uint64_t drawn(Cell c, std::uint32_t n) {
  std::uint64_t v = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.i)) << 32U |
                     static_cast<std::uint32_t>(c.j)) +
                    0x9E3779B97F4A7C15U * n;
  v = (v ^ (v >> 30U)) * 0xBF58476D1CE4E5B9U;
  v = (v ^ (v >> 27U)) * 0x94D049BB133111EBU;
  return v ^ (v >> 31U);
}

double middle_of(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  const double high = *middle;
  if (values->size() % 2 == 1) return high;
  return 0.5 * (high + *std::max_element(values->begin(), middle));
}

constexpr double kMad = 1.4826;  // standard deviation by median absolute deviation, Gaussian
constexpr double kMinScale_m = 0.01;

/// Keeps values within 3 sigma of the median.
void keep_middle(std::vector<double>* z) {
  std::vector<double> work = *z;
  const double middle = middle_of(&work);
  for (double& v : work) v = std::abs(v - middle);
  const double reach = 3.0 * std::max(kMinScale_m, kMad * middle_of(&work));
  z->erase(
      std::remove_if(z->begin(), z->end(), [&](double v) { return std::abs(v - middle) > reach; }),
      z->end());
}

/// Keeps the lowest mode: repeatedly removes values above the median by more than twice the
/// deviation of the lower half.
void keep_lowest(std::vector<double>* z) {
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds && z->size() > 2; ++round) {
    std::vector<double> work = *z;
    const double middle = middle_of(&work);
    work.clear();
    for (const double v : *z) {
      if (v <= middle) work.push_back(middle - v);
    }
    const double reach = 2.0 * std::max(kMinScale_m, kMad * middle_of(&work));
    const auto end =
        std::remove_if(z->begin(), z->end(), [&](double v) { return v - middle > reach; });
    if (end == z->end()) return;
    z->erase(end, z->end());
  }
}

}  // namespace

void SurveyGround::add(const Vec3& p) {
  const Cell c = level_.cell_at(p.x(), p.y());
  CellStatistics& place = places_.at(c);
  const auto above = static_cast<float>(p.z() - surface_at(*surface_, p.x(), p.y()).z_m);
  const std::uint32_t n = place.points;
  if (n < std::numeric_limits<std::uint32_t>::max()) ++place.points;
  ++metrics_.points;
  if (n < kKept) {
    place.above_m[n] = above;
    return;
  }
  const std::uint64_t slot = drawn(c, n) % (std::uint64_t{n} + 1);
  if (slot < kKept) place.above_m[slot] = above;
}

void SurveyGround::measure(Cell c, CellStatistics* place) const {
  const std::size_t n = std::min<std::size_t>(place->points, kKept);
  std::vector<double> z(place->above_m.begin(),
                        place->above_m.begin() + static_cast<std::ptrdiff_t>(n));
  if (above_ == Above::kNoise) {
    keep_middle(&z);
  } else {
    keep_lowest(&z);
  }
  double mean = 0.0;
  for (const double v : z) mean += v;
  mean /= static_cast<double>(z.size());
  double squares = 0.0;
  for (const double v : z) squares += (v - mean) * (v - mean);
  const Vec2 centre = level_.centre(c);
  place->above_m[0] = static_cast<float>(surface_at(*surface_, centre.x(), centre.y()).z_m + mean);
  place->above_m[2] = static_cast<float>(squares);
  place->used = static_cast<std::uint16_t>(z.size());
}

/// Sum of squares about the means of cells, and degrees of freedom, of a cell and its neighbours.
std::pair<double, int> SurveyGround::around(Cell c) const {
  double squares = 0.0;
  int free = 0;
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      const CellStatistics* at = places_.find({c.i + di, c.j + dj});
      if (at == nullptr || at->points == 0) continue;
      squares += at->squares();
      free += at->used - 1;
    }
  }
  return {squares, free};
}

void SurveyGround::finish(double sigma_m) {
  std::vector<Cell> cells;
  places_.for_each([&](Cell c, const CellStatistics& place) {
    if (place.points > 0) cells.push_back(c);
  });
  for (const Cell c : cells) measure(c, &places_.at(c));
  metrics_.cells = static_cast<std::int64_t>(cells.size());
  if (cells.empty()) return;
  constexpr int kSure = 8;  // minimum degrees of freedom of a cell for the statistics of the survey
  std::vector<double> spreads;
  for (const Cell c : cells) {
    const auto [squares, free] = around(c);
    if (free >= kSure) spreads.push_back(squares / free);
  }
  const double common = spreads.empty() ? sigma_m * sigma_m : middle_of(&spreads);
  // The variance of few points is uncertain: that of the whole survey counts as three more.
  constexpr double kPrior = 3.0;
  std::vector<double> sigmas;
  sigmas.reserve(cells.size());
  for (const Cell c : cells) {
    const auto [squares, free] = around(c);
    const double spread = (squares + kPrior * common) / (free + kPrior);
    CellStatistics& place = places_.at(c);
    // The variance of the points is noise of the survey and roughness of the ground; a share of it
    // remains in the mean.
    const double sigma = std::sqrt(std::max(sigma_m * sigma_m, spread) + spread / place.used);
    place.above_m[1] = static_cast<float>(sigma);
    sigmas.push_back(sigma);
  }
  metrics_.within_cell_median_m = std::sqrt(common);
  metrics_.sigma_median_m = middle_of(&sigmas);
}

std::vector<Cell> SurveyGround::tiles() const {
  std::set<std::pair<int, int>> known;  // j, i
  for (const Cell c : places_.blocks()) known.insert({tile_of(c).j, tile_of(c).i});
  std::vector<Cell> out;
  out.reserve(known.size());
  for (const auto& [j, i] : known) out.push_back({i, j});
  return out;
}

Raster SurveyGround::tile(Cell number) const {
  Raster r;
  r.level = level_;
  r.first = first_cell(number);
  r.width = r.height = kTileSide;
  r.z_m.assign(kTileCells, std::numeric_limits<float>::quiet_NaN());
  r.sigma_m.assign(kTileCells, 1.0F);
  r.count.assign(kTileCells, 0);
  for (int j = 0; j < kTileSide; ++j) {
    for (int i = 0; i < kTileSide; ++i) {
      const Cell c{r.first.i + i, r.first.j + j};
      const CellStatistics* place = places_.find(c);
      if (place == nullptr || place->points == 0) continue;
      const std::size_t k = r.at(c);
      r.z_m[k] = place->z_m();
      r.sigma_m[k] = place->sigma_m();
      r.count[k] = static_cast<std::uint16_t>(std::min<std::uint32_t>(place->points, 65535));
    }
  }
  return r;
}

}  // namespace rcs::mapping
