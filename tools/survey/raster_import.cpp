#include "tools/survey/raster_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "rcs/base/regular_file.h"
#include "rcs/terrain/map_tile.h"
#include "tools/mapping/map_writer.h"
#include "tools/survey/gdal_files.h"
#include "tools/survey/survey_frame.h"

namespace rcs::survey {
namespace {

constexpr int kKnot = 16;  // cells between places that are transformed exactly
constexpr double kLowest_m = -1000.0;
constexpr double kHighest_m = 10000.0;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kMaxPixels = std::int64_t{1} << 27;  // read for one tile

/// Resamples the file to the cells of the map.
class RasterSurvey {
 public:
  [[nodiscard]] static Result<RasterSurvey> open(const RasterImport& wanted);

  [[nodiscard]] const SurveyFrame& frame() const { return frame_; }
  [[nodiscard]] Result<Raster> tile(const MapLevel& level, Cell number) const;

 private:
  struct Pixels {
    int col = 0, row = 0, cols = 0, rows = 0;
    std::vector<float> z;     ///< in the unit of the file; NaN: unknown
    std::vector<float> miss;  ///< interpolation error [as z]
    [[nodiscard]] bool sample(const Vec2& pixel, double* z_out, double* miss_out) const;
  };

  RasterSurvey(const RasterImport& wanted, Dataset file, SurveyFrame frame)
      : wanted_(wanted),
        file_(std::move(file)),
        band_(file_->GetRasterBand(wanted.band)),
        frame_(std::move(frame)) {}
  [[nodiscard]] Result<Pixels> read(const Vec2& low, const Vec2& high) const;

  RasterImport wanted_;
  Dataset file_;
  GDALRasterBand* band_;
  SurveyFrame frame_;
};

Result<RasterSurvey> RasterSurvey::open(const RasterImport& wanted) {
  // GDAL interprets some names as commands and opens URLs.
  if (Outcome checked = check_regular_file(wanted.path); !checked) return checked.error();
  register_formats();
  CPLErrorReset();
  Dataset file(GDALDataset::Open(wanted.path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  if (!file) {
    return Error{fmt::format("{}: {}. Formats: {}; convert others by gdal_translate", wanted.path,
                             gdal_says(), kRasterFormats)};
  }
  if (wanted.band < 1 || wanted.band > file->GetRasterCount()) {
    return Error{fmt::format("{}: band {}, the file has {}", wanted.path, wanted.band,
                             file->GetRasterCount())};
  }
  GDALRasterBand* band = file->GetRasterBand(wanted.band);
  const double scale = band->GetScale();
  const double offset = band->GetOffset();
  if (!std::isfinite(scale) || scale == 0.0 || !std::isfinite(offset)) {
    return Error{
        fmt::format("{}: band {}: scale {} and offset {}: they must be finite, the scale not 0",
                    wanted.path, wanted.band, scale, offset)};
  }
  Result<SurveyFrame> frame = SurveyFrame::find(wanted, band);
  if (!frame) return Error{wanted.path + ": " + frame.error().message};
  return RasterSurvey(wanted, std::move(file), std::move(frame).value());
}

Result<RasterSurvey::Pixels> RasterSurvey::read(const Vec2& low, const Vec2& high) const {
  constexpr int kMargin = 4;  // for interpolation, and what it misses
  const auto bound = [](double v, int most) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(most)));
  };
  Pixels p;
  p.col = bound(std::floor(low.x()) - kMargin, band_->GetXSize());
  p.row = bound(std::floor(low.y()) - kMargin, band_->GetYSize());
  p.cols = bound(std::ceil(high.x()) + kMargin, band_->GetXSize()) - p.col;
  p.rows = bound(std::ceil(high.y()) + kMargin, band_->GetYSize()) - p.row;
  if (p.cols < 1 || p.rows < 1) {
    p.cols = p.rows = 0;
    return p;
  }
  const std::int64_t n = std::int64_t{p.cols} * p.rows;
  if (n > kMaxPixels) return Error{"too many pixels per tile: choose a smaller --cell"};
  p.z.resize(static_cast<std::size_t>(n));
  CPLErrorReset();
  if (band_->RasterIO(GF_Read, p.col, p.row, p.cols, p.rows, p.z.data(), p.cols, p.rows,
                      GDT_Float32, 0, 0, nullptr) != CE_None) {
    return Error{wanted_.path + ": " + gdal_says()};
  }
  int has_nodata = 0;
  double nodata = band_->GetNoDataValue(&has_nodata);
  if (wanted_.nodata) {
    nodata = *wanted_.nodata;
    has_nodata = 1;
  }
  const double unit_m = frame_.unit_m();
  const double scale = band_->GetScale();
  const double offset = band_->GetOffset();
  for (float& z : p.z) {
    const float value = z;
    const bool none = has_nodata != 0 && value == static_cast<float>(nodata);
    z = none || !std::isfinite(value) ? kUnknown : static_cast<float>(value * scale + offset);
    if (std::isnan(z) || (z * unit_m >= kLowest_m && z * unit_m <= kHighest_m)) continue;
    return Error{
        fmt::format("{}: {} is a height of {} m, outside {} to {} m; if it means no data, use "
                    "--nodata",
                    wanted_.path, value, z * unit_m, kLowest_m, kHighest_m)};
  }
  // Difference of a node to the mean of its neighbours on either side, root mean square over 5 x 5:
  // the interpolation error for nodes twice as far apart.
  const auto at = [&p](int c, int r) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(p.cols) +
           static_cast<std::size_t>(c);
  };
  std::vector<float> square(p.z.size(), kUnknown);
  for (int r = 1; r + 1 < p.rows; ++r) {
    for (int c = 1; c + 1 < p.cols; ++c) {
      const float x = p.z[at(c, r)] - 0.5F * (p.z[at(c - 1, r)] + p.z[at(c + 1, r)]);
      const float y = p.z[at(c, r)] - 0.5F * (p.z[at(c, r - 1)] + p.z[at(c, r + 1)]);
      square[at(c, r)] = 0.5F * (x * x + y * y);
    }
  }
  p.miss.assign(p.z.size(), 0.0F);
  for (int r = 0; r < p.rows; ++r) {
    for (int c = 0; c < p.cols; ++c) {
      double sum = 0.0;
      int count = 0;
      for (int dr = std::max(-2, -r); dr <= std::min(2, p.rows - 1 - r); ++dr) {
        for (int dc = std::max(-2, -c); dc <= std::min(2, p.cols - 1 - c); ++dc) {
          const float s = square[at(c + dc, r + dr)];
          if (std::isnan(s)) continue;
          sum += s;
          ++count;
        }
      }
      // Natural ground of Hurst exponent 0.75 deviates 2^0.75 times less over half the distance.
      constexpr double kHalf = 0.6;
      if (count > 0) p.miss[at(c, r)] = static_cast<float>(kHalf * std::sqrt(sum / count));
    }
  }
  return p;
}

bool RasterSurvey::Pixels::sample(const Vec2& pixel, double* z_out, double* miss_out) const {
  if (cols < 2 || rows < 2) return false;
  const double u = pixel.x() - 0.5 - col;
  const double v = pixel.y() - 0.5 - row;
  if (!(u >= 0.0 && v >= 0.0 && u <= cols - 1 && v <= rows - 1)) return false;
  const int c = std::min(static_cast<int>(u), cols - 2);
  const int r = std::min(static_cast<int>(v), rows - 2);
  const double s = u - c;
  const double t = v - r;
  const std::size_t k =
      static_cast<std::size_t>(r) * static_cast<std::size_t>(cols) + static_cast<std::size_t>(c);
  const auto width = static_cast<std::size_t>(cols);
  const auto mix = [&](const std::vector<float>& f) {
    const double top = f[k] + s * (f[k + 1] - f[k]);
    const double bottom = f[k + width] + s * (f[k + width + 1] - f[k + width]);
    return top + t * (bottom - top);
  };
  const double z_mixed = mix(z);
  if (std::isnan(z_mixed)) return false;
  *z_out = z_mixed;
  *miss_out = mix(miss);
  return true;
}

Result<Raster> RasterSurvey::tile(const MapLevel& level, Cell number) const {
  Raster r;
  r.level = level;
  r.first = first_cell(number);
  r.width = r.height = kTileSide;
  r.z_m.assign(kTileCells, kUnknown);
  r.sigma_m.assign(kTileCells, static_cast<float>(wanted_.quality.sigma_m));
  r.count = {1};
  r.date = {static_cast<std::uint16_t>(wanted_.quality.date)};
  r.source = {wanted_.source};

  constexpr int kKnots = kTileSide / kKnot + 1;
  std::vector<std::optional<Knot>> knots;  // nullopt: outside the projection
  Vec2 low = Vec2::Constant(1e18);
  Vec2 high = -low;
  for (int b = 0; b < kKnots; ++b) {
    for (int a = 0; a < kKnots; ++a) {
      knots.push_back(frame_.knot(level.centre({r.first.i + a * kKnot, r.first.j + b * kKnot})));
      if (!knots.back()) continue;
      for (const Vec2& pixel : knots.back()->pixel) {
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
    }
  }
  const double unit_m = frame_.unit_m();
  const Result<Pixels> pixels = read(low, high);
  if (!pixels) return pixels.error();
  if (pixels->z.empty()) return r;
  for (int j = 0; j < kTileSide; ++j) {
    for (int i = 0; i < kTileSide; ++i) {
      const std::optional<Knot>* k =
          &knots[static_cast<std::size_t>((j / kKnot) * kKnots + i / kKnot)];
      const std::array<const std::optional<Knot>*, 4> of = {k, k + 1, k + kKnots, k + kKnots + 1};
      if (std::any_of(of.begin(), of.end(), [](const auto* at) { return !*at; })) continue;
      const double s = static_cast<double>(i % kKnot) / kKnot;
      const double t = static_cast<double>(j % kKnot) / kKnot;
      const std::array<double, 4> w = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
      std::array<Vec2, 2> pixel = {Vec2::Zero(), Vec2::Zero()};
      std::array<double, 2> ellipsoidal_m{};
      double undulation_m = 0.0;
      for (std::size_t n = 0; n < 4; ++n) {
        for (std::size_t a = 0; a < 2; ++a) {
          pixel[a] += w[n] * (*of[n])->pixel[a];
          ellipsoidal_m[a] += w[n] * (*of[n])->ellipsoidal_m[a];
        }
        undulation_m += w[n] * (*of[n])->undulation_m;
      }
      // The horizontal position depends slightly on the height: two iterations suffice.
      double z = 0.0;
      double miss = 0.0;
      bool known = true;
      for (int round = 0; round < 2 && known; ++round) {
        double read = 0.0;
        known = pixels->sample(pixel[0] + z / Knot::kTall_m * (pixel[1] - pixel[0]), &read, &miss);
        const double h = read * unit_m + undulation_m;
        z = Knot::kTall_m * (h - ellipsoidal_m[0]) / (ellipsoidal_m[1] - ellipsoidal_m[0]);
      }
      if (!known) continue;
      const std::size_t cell = r.at({r.first.i + i, r.first.j + j});
      r.z_m[cell] = static_cast<float>(z);
      r.sigma_m[cell] = static_cast<float>(std::hypot(wanted_.quality.sigma_m, miss * unit_m));
    }
  }
  return r;
}

double round_to_digits(double v, int digits) {
  const double unit = std::pow(10.0, std::floor(std::log10(v)) - digits + 1);
  return std::round(v / unit) * unit;
}

}  // namespace

Result<RasterImported> import_raster(const RasterImport& wanted, const std::string& map,
                                     const std::function<bool(double)>& progress) {
  const QuietGdal quiet;
  const Result<RasterSurvey> survey = RasterSurvey::open(wanted);
  if (!survey) return survey.error();
  const SurveyFrame& frame = survey->frame();
  const double own_m = frame.pixel_m();
  const double cell_m = wanted.cell_m > 0.0 ? wanted.cell_m : round_to_digits(own_m, 3);
  if (cell_m > 1.5 * own_m || cell_m < 0.2 * own_m) {
    return Error{
        fmt::format("--cell: {} m; the raster has {:.3g} m, allowed are 0.2 to 1.5 times that "
                    "(coarser levels are added automatically)",
                    cell_m, own_m)};
  }
  const MapLevel level{cell_m, Vec2::Zero(), wanted.quality.bias_sigma_m,
                       wanted.quality.bias_correlation_m};
  Result<mapping::MapWriter> writer = mapping::MapWriter::create(map, frame.map(), {level});
  if (!writer) return writer.error();
  const Cell low = tile_of(level.cell_at(frame.low().x(), frame.low().y()));
  const Cell high = tile_of(level.cell_at(frame.high().x(), frame.high().y()));
  RasterImported out{frame.map(), cell_m, 0, 0};
  constexpr std::int64_t kMaxTiles = 1 << 20;
  const std::int64_t wide = std::int64_t{high.i} - low.i + 1;
  const std::int64_t tiles = wide * (std::int64_t{high.j} - low.j + 1);
  if (tiles > kMaxTiles) {
    return Error{
        fmt::format("{}: {} tiles of {} x {} cells, more than {}: import parts, or use a "
                    "larger --cell",
                    wanted.path, tiles, kTileSide, kTileSide, kMaxTiles)};
  }
  for (std::int64_t k = 0; k < tiles; ++k) {
    const Cell number{low.i + static_cast<int>(k % wide), low.j + static_cast<int>(k / wide)};
    const Result<Raster> tile = survey->tile(level, number);
    if (!tile) return tile.error();
    for (const float z : tile->z_m) ++(std::isnan(z) ? out.unknown : out.known);
    if (Outcome put = writer->put(0, *tile); !put) return put.error();
    if (!progress(static_cast<double>(k + 1) / static_cast<double>(tiles))) {
      return Error{"interrupted"};
    }
  }
  if (out.known == 0) return Error{wanted.path + ": no known heights"};
  Outcome done = writer->add_coarser_levels();
  if (done) done = writer->finish();
  if (!done) return done.error();
  return out;
}

}  // namespace rcs::survey
