#include "tools/survey/map_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "rcs/terrain/map_tile.h"
#include "tools/base/files.h"
#include "tools/survey/gdal_files.h"

namespace rcs::survey {
namespace {

/// The nearest-rank quantile of the values; reorders them.
/// @param values  not empty
float rank(double share, std::vector<float>* values) {
  const auto n = static_cast<double>(values->size());
  const auto at = static_cast<std::ptrdiff_t>(std::clamp(std::ceil(share * n) - 1.0, 0.0, n - 1.0));
  std::nth_element(values->begin(), values->begin() + at, values->end());
  return (*values)[static_cast<std::size_t>(at)];
}

/// Calls a function with each tile of a level of `a` and the same cells of `b`.
template <class F>
Outcome for_each_tile(const MapFolder& a, int level, mapping::MapResampler* b, const Going& going,
                      const F& with) {
  const std::vector<MapTileEntry>& tiles = a.index().levels[static_cast<std::size_t>(level)].tiles;
  std::vector<std::uint8_t> buffer;
  std::size_t done = 0;
  for (const MapTileEntry& e : tiles) {
    const Result<Raster> of_a = a.read(level, e.tile, &buffer);
    if (!of_a) return of_a.error();
    const Result<Raster> of_b = b->read(of_a->level, of_a->first, kTileSide, kTileSide);
    if (!of_b) return of_b.error();
    with(*of_a, *of_b);
    ++done;
    if (!going(static_cast<double>(done) / static_cast<double>(tiles.size()))) {
      return Error{"interrupted"};
    }
  }
  return Done{};
}

Error nothing_common(const MapFolder& a, const mapping::MapResampler& b) {
  return Error{fmt::format("{} and {}: no common known cell", a.path(), b.map().path())};
}

}  // namespace

void Differences::add(const Raster& a, const Raster& b) {
  RCS_CHECK(a.first == b.first && a.width == b.width && a.height == b.height);
  const double bias_a = a.level.bias_sigma_m;
  const double bias_b = b.level.bias_sigma_m;
  const double bias_square = bias_a * bias_a + bias_b * bias_b;
  for (std::size_t k = 0; k < a.cells(); ++k) {
    const float d = b.z_m[k] - a.z_m[k];
    if (std::isnan(d)) continue;
    d_m_.push_back(d);
    const double sigma_a = layer_at(a.sigma_m, k);
    const double sigma_b = layer_at(b.sigma_m, k);
    const double square = sigma_a * sigma_a + sigma_b * sigma_b;
    const double sigma = std::sqrt(square);
    const double with_bias = std::sqrt(square + bias_square);
    const double off = std::abs(d);
    within_[0] += off <= sigma ? 1 : 0;
    within_[1] += off <= 2.0 * sigma ? 1 : 0;
    within_[2] += off <= with_bias ? 1 : 0;
    within_[3] += off <= 2.0 * with_bias ? 1 : 0;
  }
}

MapDifference Differences::metrics() const {
  MapDifference f;
  f.cells = static_cast<std::int64_t>(d_m_.size());
  if (d_m_.empty()) return f;
  const auto n = static_cast<double>(d_m_.size());
  double sum = 0.0;
  double squares = 0.0;
  for (const float d : d_m_) {
    sum += d;
    squares += static_cast<double>(d) * d;
  }
  f.mean_m = sum / n;
  f.rms_m = std::sqrt(squares / n);
  std::vector<float> v = d_m_;
  const float median = rank(0.5, &v);
  f.median_m = median;
  for (float& d : v) d = std::abs(d - median);
  constexpr double kOfNormal = 1.4826;  // sigma over the median deviation
  f.nmad_m = kOfNormal * rank(0.5, &v);
  std::transform(d_m_.begin(), d_m_.end(), v.begin(), [](float d) { return std::abs(d); });
  f.p95_m = rank(0.95, &v);
  const auto share = [&](std::size_t k) { return static_cast<double>(within_[k]) / n; };
  f.by_sigma = {share(0), share(1)};
  f.with_bias = {share(2), share(3)};
  return f;
}

Result<MapDifference> difference_of(const MapFolder& a, int level, mapping::MapResampler* b,
                                    const Going& going) {
  Differences all;
  const Outcome done = for_each_tile(
      a, level, b, going, [&](const Raster& of_a, const Raster& of_b) { all.add(of_a, of_b); });
  if (!done) return done.error();
  const MapDifference metrics = all.metrics();
  if (metrics.cells == 0) return nothing_common(a, *b);
  return metrics;
}

Result<Raster> difference_raster(const MapFolder& a, int level, mapping::MapResampler* b,
                                 const Going& going) {
  constexpr std::int64_t kMaxCells = std::int64_t{1} << 26;
  const MapLevelIndex& index = a.index().levels[static_cast<std::size_t>(level)];
  if (index.tiles.empty()) return nothing_common(a, *b);
  Cell low = index.tiles.front().tile;
  Cell high = low;
  for (const MapTileEntry& e : index.tiles) {
    low = {std::min(low.i, e.tile.i), std::min(low.j, e.tile.j)};
    high = {std::max(high.i, e.tile.i), std::max(high.j, e.tile.j)};
  }
  const std::int64_t width = (std::int64_t{high.i} - low.i + 1) * kTileSide;
  const std::int64_t height = (std::int64_t{high.j} - low.j + 1) * kTileSide;
  if (width * height > kMaxCells) {
    return Error{fmt::format("{}: {} x {} cells of {} m are too many for a picture (2^26)",
                             a.path(), width, height, index.level.cell_m)};
  }
  Raster d;
  d.level = index.level;
  d.first = first_cell(low);
  d.width = static_cast<int>(width);
  d.height = static_cast<int>(height);
  d.z_m.assign(d.cells(), std::numeric_limits<float>::quiet_NaN());
  Cell first{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
  Cell last{std::numeric_limits<int>::min(), std::numeric_limits<int>::min()};
  const auto lay = [&](const Raster& of_a, const Raster& of_b) {
    for (int j = of_a.first.j; j < of_a.first.j + of_a.height; ++j) {
      for (int i = of_a.first.i; i < of_a.first.i + of_a.width; ++i) {
        const std::size_t k = of_a.at({i, j});
        const float off = of_b.z_m[k] - of_a.z_m[k];
        if (std::isnan(off)) continue;
        d.z_m[d.at({i, j})] = off;
        first = {std::min(first.i, i), std::min(first.j, j)};
        last = {std::max(last.i, i), std::max(last.j, j)};
      }
    }
  };
  if (Outcome done = for_each_tile(a, level, b, going, lay); !done) return done.error();
  if (first.i > last.i) return nothing_common(a, *b);
  return cut(d, first, last.i - first.i + 1, last.j - first.j + 1);
}

std::array<std::uint8_t, 4> difference_color(float d_m, double range_m) {
  if (std::isnan(d_m)) return {0, 0, 0, 0};
  constexpr std::array<double, 3> kBelow = {33.0, 102.0, 172.0};
  constexpr std::array<double, 3> kAbove = {178.0, 24.0, 43.0};
  constexpr double kWhite = 255.0;
  const double share = std::min(1.0, std::abs(d_m) / range_m);
  const std::array<double, 3>& end = d_m < 0.0F ? kBelow : kAbove;
  std::array<std::uint8_t, 4> color{0, 0, 0, 255};
  for (std::size_t c = 0; c < 3; ++c) {
    color[c] = static_cast<std::uint8_t>(std::lround(kWhite + share * (end[c] - kWhite)));
  }
  return color;
}

Outcome write_difference(const Raster& difference, double range_m, const std::string& path) {
  const QuietGdal quiet;
  register_formats();
  CPLErrorReset();
  constexpr int kBands = 4;
  const int width = difference.width;
  const int height = difference.height;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("MEM");
  const Dataset memory(
      driver == nullptr ? nullptr : driver->Create("", width, height, kBands, GDT_Byte, nullptr));
  if (!memory) return Error{path + ": " + gdal_says()};
  constexpr std::array<GDALColorInterp, kBands> kMeaning = {GCI_RedBand, GCI_GreenBand,
                                                            GCI_BlueBand, GCI_AlphaBand};
  for (int b = 0; b < kBands; ++b) {
    GDALRasterBand* band = memory->GetRasterBand(b + 1);
    band->SetColorInterpretation(kMeaning[static_cast<std::size_t>(b)]);
    std::vector<std::uint8_t> row(static_cast<std::size_t>(width));
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        const Cell c{difference.first.i + i, difference.first.j + j};
        row[static_cast<std::size_t>(i)] = difference_color(difference.z_m[difference.at(c)],
                                                            range_m)[static_cast<std::size_t>(b)];
      }
      // GDAL's rows go from north to south.
      if (band->RasterIO(GF_Write, 0, height - 1 - j, width, 1, row.data(), width, 1, GDT_Byte, 0,
                         0, nullptr) != CE_None) {
        return Error{path + ": " + gdal_says()};
      }
    }
  }
  driver = GetGDALDriverManager()->GetDriverByName("PNG");
  CPLErrorReset();
  Dataset written(driver == nullptr
                      ? nullptr
                      : driver->CreateCopy(kInMemory, memory.get(), 0, nullptr, nullptr, nullptr));
  return close_and_write(std::move(written), path);
}

}  // namespace rcs::survey
