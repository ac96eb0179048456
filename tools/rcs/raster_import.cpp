#include "tools/rcs/raster_import.h"

#include <fmt/format.h>
#include <gdal.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::tools {
namespace {

constexpr int kKnot = 16;         // cells between places that are transformed exactly
constexpr double kTall_m = 1000;  // heights at which they are
constexpr double kLowest_m = -1000.0;
constexpr double kHighest_m = 10000.0;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kMostPixels = std::int64_t{1} << 27;  // read for one tile

struct CloseDataset {
  void operator()(GDALDataset* d) const { GDALClose(d); }
};
struct DestroyTransform {
  void operator()(OGRCoordinateTransformation* t) const {
    OGRCoordinateTransformation::DestroyCT(t);
  }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;
using Transform = std::unique_ptr<OGRCoordinateTransformation, DestroyTransform>;

/// GDAL's own messages go into ours, not to stderr.
class QuietGdal {
 public:
  QuietGdal() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

std::string gdal_says() {
  std::string text = CPLGetLastErrorMsg();
  if (text.size() > 200) text = text.substr(0, 200) + "...";
  return text.empty() ? "GDAL does not say why" : text;
}

/// The common name of a geodetic datum.
std::string reference_of(const OGRSpatialReference& crs) {
  const char* datum = crs.GetAttrValue("DATUM");
  if (datum == nullptr) return "unknown";
  std::string name = datum;
  if (name.find("WGS_1984") != std::string::npos ||
      name.find("World Geodetic System 1984") != std::string::npos) {
    return "WGS84";
  }
  if (name == "North_American_Datum_1983") return "NAD83";
  if (name == "European_Terrestrial_Reference_System_1989") return "ETRS89";
  return name;
}

std::string vertical_crs(const std::string& heights) {
  if (heights == "EGM96") return "EPSG:5773";
  if (heights == "EGM2008") return "EPSG:3855";
  return heights;
}

/// What is read from the file, and how its coordinates go over into the map's.
class Survey {
 public:
  [[nodiscard]] static Result<Survey> open(const RasterImport& wanted);

  [[nodiscard]] const MapFrame& frame() const { return frame_; }
  [[nodiscard]] double pixel_m() const { return pixel_m_; }
  [[nodiscard]] const Vec2& low() const { return low_; }    ///< corners of the raster's extent
  [[nodiscard]] const Vec2& high() const { return high_; }  ///< in the map's frame
  [[nodiscard]] Result<Raster> tile(const MapLevel& level, Cell number) const;

 private:
  struct Knot {
    std::array<Vec2, 2> pixel;              ///< column, row at z = 0 and z = kTall_m
    std::array<double, 2> ellipsoidal_m{};  ///< heights there
    double undulation_m = 0.0;
  };
  struct Pixels {
    int col = 0, row = 0, cols = 0, rows = 0;
    std::vector<float> z;     ///< as in the file; NaN: none
    std::vector<float> miss;  ///< what interpolation misses [as z]
    [[nodiscard]] bool sample(const Vec2& pixel, double* z_out, double* miss_out) const;
  };

  Survey() = default;
  [[nodiscard]] Outcome find_frame(const RasterImport& wanted);
  [[nodiscard]] Outcome find_heights(const RasterImport& wanted);
  [[nodiscard]] Outcome find_extent();
  [[nodiscard]] std::optional<Knot> knot(const Vec2& place_m) const;
  [[nodiscard]] Result<Pixels> read(const Vec2& low, const Vec2& high) const;
  [[nodiscard]] std::optional<Vec2> pixel_of(const Geodetic& g) const;
  [[nodiscard]] std::optional<double> undulation_at(const Geodetic& g) const;
  [[nodiscard]] std::optional<Geodetic> geodetic_of(const Vec2& pixel) const;

  std::string path_;
  Dataset file_;
  GDALRasterBand* band_ = nullptr;
  std::array<double, 6> affine_{};   // pixel to projected
  std::array<double, 6> inverse_{};  // projected to pixel
  OGRSpatialReference crs_, geographic_;
  Transform to_crs_, to_geographic_, to_ellipsoid_;
  std::optional<double> undulation_m_;
  double unit_m_ = 1.0;
  double pixel_m_ = 0.0;
  std::optional<double> nodata_;
  SurveyQuality quality_;
  CellSource source_ = CellSource::kAerial;
  MapFrame frame_;
  std::optional<LocalFrame> local_;
  Vec2 low_, high_;
};

Result<Survey> Survey::open(const RasterImport& wanted) {
  GDALAllRegister();
  Survey s;
  s.path_ = wanted.path;
  s.quality_ = wanted.quality;
  s.source_ = wanted.source;
  s.nodata_ = wanted.nodata;
  CPLErrorReset();
  s.file_.reset(GDALDataset::Open(wanted.path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  if (!s.file_) return Error{wanted.path + ": " + gdal_says()};
  if (wanted.band < 1 || wanted.band > s.file_->GetRasterCount()) {
    return Error{
        fmt::format("{}: band {}, it has {}", wanted.path, wanted.band, s.file_->GetRasterCount())};
  }
  s.band_ = s.file_->GetRasterBand(wanted.band);
  if (s.file_->GetGeoTransform(s.affine_.data()) != CE_None ||
      GDALInvGeoTransform(s.affine_.data(), s.inverse_.data()) == 0) {
    return Error{wanted.path + ": does not say where its pixels lie (no geotransform)"};
  }
  Outcome done = s.find_frame(wanted);
  if (done) done = s.find_heights(wanted);
  if (done) done = s.find_extent();
  if (!done) return Error{wanted.path + ": " + done.error().message};
  return s;
}

Outcome Survey::find_frame(const RasterImport& wanted) {
  if (!wanted.crs.empty()) {
    if (crs_.SetFromUserInput(wanted.crs.c_str()) != OGRERR_NONE) {
      return Error{"--crs: " + wanted.crs + " is no coordinate reference system"};
    }
  } else if (const OGRSpatialReference* own = file_->GetSpatialRef()) {
    crs_ = *own;
  } else {
    return Error{"has no coordinate reference system: say it with --crs, e.g. EPSG:32611"};
  }
  if (crs_.IsLocal() != 0 || (crs_.IsProjected() == 0 && crs_.IsGeographic() == 0)) {
    return Error{"its coordinate reference system does not lie on the earth"};
  }
  crs_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference flat = crs_;
  flat.StripVertical();
  flat.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRSpatialReference> geographic(flat.CloneGeogCS());
  geographic_ = *geographic;
  geographic_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  to_geographic_.reset(OGRCreateCoordinateTransformation(&flat, &geographic_));
  to_crs_.reset(OGRCreateCoordinateTransformation(&geographic_, &flat));
  if (!to_geographic_ || !to_crs_) return Error{"PROJ can't transform it: " + gdal_says()};
  frame_.reference = reference_of(geographic_);
  frame_.source_crs = crs_.GetName() == nullptr ? "unnamed" : crs_.GetName();
  return Done{};
}

Outcome Survey::find_heights(const RasterImport& wanted) {
  unit_m_ = wanted.height_unit_m;
  if (unit_m_ == 0.0) {
    const std::string unit = band_->GetUnitType();
    constexpr double kFoot_m = 0.3048;
    constexpr double kSurveyFoot_m = 1200.0 / 3937.0;
    if (unit.empty() || unit == "m" || unit == "metre" || unit == "meter") {
      unit_m_ = 1.0;
    } else if (unit == "ft" || unit == "foot") {
      unit_m_ = kFoot_m;
    } else if (unit == "US survey foot" || unit == "ftUS") {
      unit_m_ = kSurveyFoot_m;
    } else {
      return Error{"heights in '" + unit + "': say with --height-unit how many metres that is"};
    }
  }
  if (wanted.undulation_m) {
    undulation_m_ = wanted.undulation_m;
    return Done{};
  }
  std::string heights = wanted.heights;
  if (heights.empty() && crs_.IsVertical() != 0) {
    OGRSpatialReference above = crs_;
    const char* name = above.GetAttrValue("VERT_CS");
    heights = name == nullptr ? "" : name;
  }
  if (heights.empty()) {
    return Error{
        "does not say what its heights are above: --heights ellipsoid, EGM96, EGM2008 or an EPSG "
        "code of a vertical datum; or --undulation"};
  }
  if (heights == "ellipsoid") return Done{};
  OGRSpatialReference compound;
  OGRSpatialReference vertical;
  const std::string code = vertical_crs(heights);
  if (wanted.heights.empty()) {
    compound = crs_;
    const std::unique_ptr<OGRSpatialReference> flat(geographic_.Clone());
    OGRSpatialReference only = crs_;
    const OGR_SRSNode* node = only.GetAttrNode("VERT_CS");
    if (node == nullptr) return Error{"its vertical datum can't be read; say it with --heights"};
    char* wkt = nullptr;
    node->exportToWkt(&wkt);
    vertical.importFromWkt(wkt);
    CPLFree(wkt);
  } else if (vertical.SetFromUserInput(code.c_str()) != OGRERR_NONE || vertical.IsVertical() == 0) {
    return Error{"--heights: " + heights + " is no vertical datum"};
  }
  if (compound.SetCompoundCS("compound", &geographic_, &vertical) != OGRERR_NONE) {
    return Error{"its heights above " + heights + " do not go with its coordinates"};
  }
  compound.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference ellipsoidal = geographic_;
  ellipsoidal.PromoteTo3D(nullptr);
  ellipsoidal.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRCoordinateTransformationOptions exact;
  exact.SetBallparkAllowed(false);
  to_ellipsoid_.reset(OGRCreateCoordinateTransformation(&compound, &ellipsoidal, exact));
  if (!to_ellipsoid_) {
    return Error{"PROJ has no grid for heights above " + heights +
                 " here (package proj-data has EGM96's): give --undulation"};
  }
  return Done{};
}

std::optional<double> Survey::undulation_at(const Geodetic& g) const {
  if (undulation_m_) return undulation_m_;
  if (!to_ellipsoid_) return 0.0;
  double lon = degrees(g.lon_rad);
  double lat = degrees(g.lat_rad);
  double h = 0.0;
  if (to_ellipsoid_->Transform(1, &lon, &lat, &h) == 0 || !std::isfinite(h)) return std::nullopt;
  return h;
}

std::optional<Vec2> Survey::pixel_of(const Geodetic& g) const {
  double x = degrees(g.lon_rad);
  double y = degrees(g.lat_rad);
  if (to_crs_->Transform(1, &x, &y) == 0) return std::nullopt;
  return Vec2(inverse_[0] + inverse_[1] * x + inverse_[2] * y,
              inverse_[3] + inverse_[4] * x + inverse_[5] * y);
}

std::optional<Geodetic> Survey::geodetic_of(const Vec2& pixel) const {
  double x = affine_[0] + affine_[1] * pixel.x() + affine_[2] * pixel.y();
  double y = affine_[3] + affine_[4] * pixel.x() + affine_[5] * pixel.y();
  if (to_geographic_->Transform(1, &x, &y) == 0) return std::nullopt;
  const Geodetic g{radians(y), radians(x), {0.0}};
  return plausible(g) ? std::optional<Geodetic>(g) : std::nullopt;
}

Outcome Survey::find_extent() {
  const double cols = band_->GetXSize();
  const double rows = band_->GetYSize();
  const Vec2 middle(0.5 * cols, 0.5 * rows);
  const std::optional<Geodetic> datum = geodetic_of(middle);
  if (!datum) return Error{"its middle is not on the earth"};
  const std::optional<double> undulation = undulation_at(*datum);
  if (!undulation) return Error{"PROJ's grid does not reach its middle: give --undulation"};
  frame_.datum = *datum;
  if (undulation_m_ || to_ellipsoid_) frame_.undulation_m = *undulation;
  local_.emplace(*datum);
  const auto place = [&](const Vec2& pixel) -> std::optional<Vec2> {
    const std::optional<Geodetic> g = geodetic_of(pixel);
    if (!g) return std::nullopt;
    return Vec2(local_->to_world(*g).head<2>());
  };
  const std::optional<Vec2> east = place(middle + Vec2::UnitX());
  const std::optional<Vec2> south = place(middle + Vec2::UnitY());
  if (!east || !south) return Error{"its middle is not on the earth"};
  pixel_m_ = std::sqrt(std::abs(east->x() * south->y() - east->y() * south->x()));
  if (!(pixel_m_ >= 0.01 && pixel_m_ <= 10000.0)) {
    return Error{fmt::format("its pixels are {} m wide, allowed 0.01 to 10000", pixel_m_)};
  }
  low_ = high_ = Vec2::Zero();
  constexpr int kSteps = 20;
  for (int k = 0; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps;
    for (const Vec2& pixel : {Vec2(share * cols, 0.0), Vec2(share * cols, rows),
                              Vec2(0.0, share * rows), Vec2(cols, share * rows)}) {
      const std::optional<Vec2> p = place(pixel);
      if (!p) return Error{"its border is not on the earth"};
      low_ = low_.cwiseMin(*p);
      high_ = high_.cwiseMax(*p);
    }
  }
  constexpr double kFarthest_m = 2e5;  // a tangent plane is 3 km above the ground there
  if (std::max(-low_.minCoeff(), high_.maxCoeff()) > kFarthest_m) {
    return Error{"spans more than 400 km: cut it first (gdal_translate -projwin)"};
  }
  return Done{};
}

std::optional<Survey::Knot> Survey::knot(const Vec2& place_m) const {
  Knot k;
  for (std::size_t a = 0; a < 2; ++a) {
    const double z = a == 0 ? 0.0 : kTall_m;
    const Geodetic g = local_->to_geodetic({place_m.x(), place_m.y(), z});
    const std::optional<Vec2> pixel = pixel_of(g);
    const std::optional<double> undulation = undulation_at(g);
    if (!pixel || !undulation) return std::nullopt;
    k.pixel[a] = *pixel;
    k.ellipsoidal_m[a] = g.height.m;
    k.undulation_m = *undulation;
  }
  return k;
}

Result<Survey::Pixels> Survey::read(const Vec2& low, const Vec2& high) const {
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
  if (n > kMostPixels) return Error{"too many pixels a tile: choose a smaller --cell"};
  p.z.resize(static_cast<std::size_t>(n));
  CPLErrorReset();
  if (band_->RasterIO(GF_Read, p.col, p.row, p.cols, p.rows, p.z.data(), p.cols, p.rows,
                      GDT_Float32, 0, 0, nullptr) != CE_None) {
    return Error{path_ + ": " + gdal_says()};
  }
  int has_nodata = 0;
  double nodata = band_->GetNoDataValue(&has_nodata);
  if (nodata_) {
    nodata = *nodata_;
    has_nodata = 1;
  }
  for (float& z : p.z) {
    if ((has_nodata != 0 && z == static_cast<float>(nodata)) || !std::isfinite(z)) z = kUnknown;
    if (std::isnan(z) || (z * unit_m_ >= kLowest_m && z * unit_m_ <= kHighest_m)) continue;
    return Error{
        fmt::format("{}: a height of {} is not on the earth ({} to {} m): no data? Then "
                    "say so with --nodata",
                    path_, z, kLowest_m, kHighest_m)};
  }
  // What the mean of a node's neighbours on either side misses of it, root mean square over 5 x 5:
  // the error in the middle between nodes twice as far apart.
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

bool Survey::Pixels::sample(const Vec2& pixel, double* z_out, double* miss_out) const {
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

Result<Raster> Survey::tile(const MapLevel& level, Cell number) const {
  Raster r;
  r.level = level;
  r.first = first_cell(number);
  r.width = r.height = kTileSide;
  r.z_m.assign(kTileCells, kUnknown);
  r.sigma_m.assign(kTileCells, static_cast<float>(quality_.sigma_m));
  r.count = {1};
  r.date = {static_cast<std::uint16_t>(quality_.date)};
  r.source = {source_};

  constexpr int kKnots = kTileSide / kKnot + 1;
  std::vector<Knot> knots;
  Vec2 low = Vec2::Constant(1e18);
  Vec2 high = -low;
  for (int b = 0; b < kKnots; ++b) {
    for (int a = 0; a < kKnots; ++a) {
      const std::optional<Knot> k =
          knot(level.centre({r.first.i + a * kKnot, r.first.j + b * kKnot}));
      if (!k) return r;  // the projection does not reach there: unknown
      for (const Vec2& pixel : k->pixel) {
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
      knots.push_back(*k);
    }
  }
  const Result<Pixels> pixels = read(low, high);
  if (!pixels) return pixels.error();
  if (pixels->z.empty()) return r;
  for (int j = 0; j < kTileSide; ++j) {
    for (int i = 0; i < kTileSide; ++i) {
      const Knot* k = &knots[static_cast<std::size_t>((j / kKnot) * kKnots + i / kKnot)];
      const double s = static_cast<double>(i % kKnot) / kKnot;
      const double t = static_cast<double>(j % kKnot) / kKnot;
      const std::array<double, 4> w = {(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
      const std::array<const Knot*, 4> of = {k, k + 1, k + kKnots, k + kKnots + 1};
      std::array<Vec2, 2> pixel = {Vec2::Zero(), Vec2::Zero()};
      std::array<double, 2> ellipsoidal_m{};
      double undulation_m = 0.0;
      for (std::size_t n = 0; n < 4; ++n) {
        for (std::size_t a = 0; a < 2; ++a) {
          pixel[a] += w[n] * of[n]->pixel[a];
          ellipsoidal_m[a] += w[n] * of[n]->ellipsoidal_m[a];
        }
        undulation_m += w[n] * of[n]->undulation_m;
      }
      // Where the ground is depends on its height, a little: twice around is enough.
      double z = 0.0;
      double miss = 0.0;
      bool known = true;
      for (int round = 0; round < 2 && known; ++round) {
        double read = 0.0;
        known = pixels->sample(pixel[0] + z / kTall_m * (pixel[1] - pixel[0]), &read, &miss);
        const double h = read * unit_m_ + undulation_m;
        z = kTall_m * (h - ellipsoidal_m[0]) / (ellipsoidal_m[1] - ellipsoidal_m[0]);
      }
      if (!known) continue;
      const std::size_t cell = r.at({r.first.i + i, r.first.j + j});
      r.z_m[cell] = static_cast<float>(z);
      r.sigma_m[cell] = static_cast<float>(std::hypot(quality_.sigma_m, miss * unit_m_));
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
  const Result<Survey> survey = Survey::open(wanted);
  if (!survey) return survey.error();
  const double own_m = survey->pixel_m();
  const double cell_m = wanted.cell_m > 0.0 ? wanted.cell_m : round_to_digits(own_m, 3);
  if (cell_m > 1.5 * own_m || cell_m < 0.2 * own_m) {
    return Error{
        fmt::format("--cell: {} m; the raster has {:.3g} m, allowed are 0.2 to 1.5 of it "
                    "(coarser levels are made anyway)",
                    cell_m, own_m)};
  }
  const MapLevel level{cell_m, Vec2::Zero(), wanted.quality.bias_sigma_m,
                       wanted.quality.bias_correlation_m};
  Result<MapWriter> writer = MapWriter::create(map, survey->frame(), {level});
  if (!writer) return writer.error();
  const Cell low = tile_of(level.cell_at(survey->low().x(), survey->low().y()));
  const Cell high = tile_of(level.cell_at(survey->high().x(), survey->high().y()));
  RasterImported out{survey->frame(), cell_m, 0, 0};
  const int wide = high.i - low.i + 1;
  const int tiles = wide * (high.j - low.j + 1);
  for (int k = 0; k < tiles; ++k) {
    const Result<Raster> tile = survey->tile(level, {low.i + k % wide, low.j + k / wide});
    if (!tile) return tile.error();
    for (const float z : tile->z_m) ++(std::isnan(z) ? out.unknown : out.known);
    if (Outcome put = writer->put(0, *tile); !put) return put.error();
    if (!progress(static_cast<double>(k + 1) / tiles)) return Error{"interrupted"};
  }
  if (out.known == 0) return Error{wanted.path + ": not one height is known"};
  Outcome done = writer->add_coarser_levels();
  if (done) done = writer->finish();
  if (!done) return done.error();
  return out;
}

}  // namespace rcs::tools
