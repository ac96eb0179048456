#include "tools/survey/survey_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace rcs::survey {
namespace {

constexpr const char* kNoNetwork[] = {"ALLOW_NETWORK_ACCESS=NO", nullptr};

/// The common name of a geodetic reference frame.
std::string reference_of(const OGRSpatialReference& geographic) {
  const char* text = geographic.GetAttrValue("DATUM");
  const std::string datum = text == nullptr ? "unknown" : text;
  if (datum == "WGS_1984") return "WGS84";
  if (datum == "North_American_Datum_1983") return "NAD83";
  if (datum == "European_Terrestrial_Reference_System_1989") return "ETRS89";
  // Coordinate systems are named "NAD83(2011)", datums by the long name.
  text = geographic.GetName();
  const std::string name = text == nullptr ? "unknown" : text;
  return name == "unknown" || name == "unnamed" ? datum : name;
}

/// The PROJ name of the vertical datum `heights`.
std::string vertical_crs(const std::string& heights) {
  if (heights == "EGM96") return "EPSG:5773";
  if (heights == "EGM2008") return "EPSG:3855";
  return heights;
}

/// The vertical part of a compound system; empty: none.
std::string vertical_part(const OGRSpatialReference& crs) {
  const OGR_SRSNode* node = crs.GetAttrNode("VERT_CS");
  if (node == nullptr) return {};
  char* wkt = nullptr;
  node->exportToWkt(&wkt);
  std::string text = wkt;
  CPLFree(wkt);
  return text;
}

}  // namespace

Result<SurveyFrame> SurveyFrame::find(const SurveyCoordinates& wanted, GDALRasterBand* band) {
  SurveyFrame f;
  GDALDataset* file = band->GetDataset();
  if (file->GetGeoTransform(f.affine_.data()) != CE_None ||
      GDALInvGeoTransform(f.affine_.data(), f.inverse_.data()) == 0) {
    return Error{"has no geotransform (positions of its pixels)"};
  }
  Outcome done = f.find_frame(wanted, file->GetSpatialRef());
  if (done) done = f.find_unit(wanted, band->GetUnitType());
  if (done) done = f.find_heights(wanted);
  if (done) done = f.find_extent(band->GetXSize(), band->GetYSize());
  if (!done) return done.error();
  if (!(f.pixel_m_ >= 0.01 && f.pixel_m_ <= 10000.0)) {
    return Error{fmt::format("its pixels are {} m wide, allowed 0.01 to 10000", f.pixel_m_)};
  }
  return f;
}

Result<SurveyFrame> SurveyFrame::find(const SurveyCoordinates& wanted,
                                      const OGRSpatialReference* own, const Vec2& low,
                                      const Vec2& high) {
  SurveyFrame f;
  // One pixel, which is the extent.
  constexpr double kMin = 1e-6;  // metres or degrees
  const Vec2 size = (high - low).cwiseMax(Vec2::Constant(kMin));
  f.affine_ = {low.x(), size.x(), 0.0, low.y(), 0.0, size.y()};
  if (GDALInvGeoTransform(f.affine_.data(), f.inverse_.data()) == 0) {
    return Error{"the extent of its points is empty"};
  }
  Outcome done = f.find_frame(wanted, own);
  if (done) done = f.find_point_unit(wanted);
  if (done) done = f.find_heights(wanted);
  if (done) done = f.find_extent(1.0, 1.0);
  if (!done) return done.error();
  return f;
}

Outcome SurveyFrame::find_frame(const SurveyCoordinates& wanted, const OGRSpatialReference* own) {
  if (!wanted.crs.empty()) {
    if (crs_.SetFromUserInput(wanted.crs.c_str(), kNoNetwork) != OGRERR_NONE) {
      return Error{"--crs: " + wanted.crs + " is not a coordinate reference system"};
    }
  } else if (own != nullptr) {
    crs_ = *own;
  } else {
    return Error{"has no coordinate reference system: use --crs, e.g. EPSG:32611"};
  }
  if (crs_.IsLocal() != 0 || (crs_.IsProjected() == 0 && crs_.IsGeographic() == 0)) {
    return Error{"its coordinate reference system is not georeferenced"};
  }
  crs_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference flat = crs_;
  flat.StripVertical();
  flat.DemoteTo2D(nullptr);
  flat.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRSpatialReference> geographic(flat.CloneGeogCS());
  geographic_ = *geographic;
  geographic_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  to_geographic_.reset(OGRCreateCoordinateTransformation(&flat, &geographic_));
  to_crs_.reset(OGRCreateCoordinateTransformation(&geographic_, &flat));
  if (!to_geographic_ || !to_crs_) return Error{"PROJ can't transform it: " + gdal_says()};
  map_.reference = reference_of(geographic_);
  map_.source_crs = crs_.GetName() == nullptr ? "unnamed" : crs_.GetName();
  return Done{};
}

Outcome SurveyFrame::find_unit(const SurveyCoordinates& wanted, const std::string& own) {
  constexpr double kFoot_m = 0.3048;
  constexpr double kSurveyFoot_m = 1200.0 / 3937.0;
  if (wanted.height_unit_m != 0.0) {
    unit_m_ = wanted.height_unit_m;
  } else if (own.empty()) {
    const Result<double> unit_m = find_system_unit(wanted.heights);
    if (!unit_m) return unit_m.error();
    unit_m_ = *unit_m;
  } else if (own == "m" || own == "metre" || own == "meter") {
    unit_m_ = 1.0;
  } else if (own == "ft" || own == "foot") {
    unit_m_ = kFoot_m;
  } else if (own == "US survey foot" || own == "ftUS") {
    unit_m_ = kSurveyFoot_m;
  } else {
    return Error{"heights in '" + own + "': give this unit in metres by --height-unit"};
  }
  return Done{};
}

Outcome SurveyFrame::find_point_unit(const SurveyCoordinates& wanted) {
  if (Outcome found = find_unit(wanted, ""); !found) return found;
  double own_m = 0.0;
  crs_.GetAxis(nullptr, 2, nullptr, &own_m);
  const double across_m = crs_.IsProjected() != 0 ? crs_.GetLinearUnits() : 1.0;
  const bool is_said = wanted.height_unit_m != 0.0 || own_m > 0.0 || unit_m_ != 1.0;
  if (is_said || std::abs(across_m - 1.0) < 1e-9) return Done{};
  return Error{fmt::format(
      "its coordinates are in units of {:.9g} m, and the unit of its heights is unknown: use "
      "--height-unit [m], 1 or {:.9g}",
      across_m, across_m)};
}

/// From the system of the survey or that of `heights`; 1 if neither has a unit.
Result<double> SurveyFrame::find_system_unit(const std::string& heights) const {
  double own_m = 0.0;
  crs_.GetAxis(nullptr, 2, nullptr, &own_m);
  OGRSpatialReference vertical;
  const bool named =
      !heights.empty() && heights != "ellipsoid" &&
      vertical.SetFromUserInput(vertical_crs(heights).c_str(), kNoNetwork) == OGRERR_NONE &&
      vertical.IsVertical() != 0;
  const double named_m = named ? vertical.GetTargetLinearUnits("VERT_CS") : 0.0;
  if (own_m > 0.0 && named_m > 0.0 && std::abs(own_m - named_m) > 1e-9) {
    return Error{fmt::format(
        "heights in units of {} m by its coordinate reference system, of {} m by --heights {}: "
        "select one by --height-unit",
        own_m, named_m, heights)};
  }
  if (own_m > 0.0) return own_m;
  return named_m > 0.0 ? named_m : 1.0;
}

Outcome SurveyFrame::find_heights(const SurveyCoordinates& wanted) {
  undulation_m_ = wanted.undulation_m;
  const bool in_space = crs_.GetAxesCount() == 3 && crs_.IsCompound() == 0;
  if (undulation_m_ || wanted.heights == "ellipsoid" || (wanted.heights.empty() && in_space)) {
    return Done{};
  }
  const std::string datum =
      wanted.heights.empty() ? vertical_part(crs_) : vertical_crs(wanted.heights);
  if (datum.empty()) {
    return Error{
        "has no reference of its heights: use --heights ellipsoid, EGM96, EGM2008 or an EPSG code "
        "of a vertical datum; or --undulation"};
  }
  OGRSpatialReference vertical;
  if (vertical.SetFromUserInput(datum.c_str(), kNoNetwork) != OGRERR_NONE ||
      vertical.IsVertical() == 0 || vertical.IsCompound() != 0) {
    return Error{"--heights: " + datum + " is not a vertical datum"};
  }
  const std::string name = wanted.heights.empty() ? vertical.GetName() : wanted.heights;
  OGRSpatialReference compound;
  if (compound.SetCompoundCS("compound", &geographic_, &vertical) != OGRERR_NONE) {
    return Error{"its heights above " + name + " cannot be combined with its coordinates"};
  }
  compound.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference ellipsoidal = geographic_;
  ellipsoidal.PromoteTo3D(nullptr);
  ellipsoidal.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRCoordinateTransformationOptions exact;
  exact.SetBallparkAllowed(false);
  to_ellipsoid_.reset(OGRCreateCoordinateTransformation(&compound, &ellipsoidal, exact));
  if (!to_ellipsoid_) {
    return Error{"PROJ has no grid for heights above " + name +
                 " (the package proj-data contains EGM96): use --undulation"};
  }
  return Done{};
}

std::optional<double> SurveyFrame::undulation_at(const Geodetic& g) const {
  if (undulation_m_) return undulation_m_;
  if (!to_ellipsoid_) return 0.0;
  double lon = degrees(g.lon_rad);
  double lat = degrees(g.lat_rad);
  double h = 0.0;
  if (to_ellipsoid_->Transform(1, &lon, &lat, &h) == 0 || !std::isfinite(h)) return std::nullopt;
  return h;
}

std::optional<Vec2> SurveyFrame::pixel_of(const Geodetic& g) const {
  double x = degrees(g.lon_rad);
  double y = degrees(g.lat_rad);
  if (to_crs_->Transform(1, &x, &y) == 0) return std::nullopt;
  const Vec2 pixel(inverse_[0] + inverse_[1] * x + inverse_[2] * y,
                   inverse_[3] + inverse_[4] * x + inverse_[5] * y);
  return pixel.allFinite() ? std::optional<Vec2>(pixel) : std::nullopt;
}

std::optional<Geodetic> SurveyFrame::geodetic_of(const Vec2& pixel) const {
  double x = affine_[0] + affine_[1] * pixel.x() + affine_[2] * pixel.y();
  double y = affine_[3] + affine_[4] * pixel.x() + affine_[5] * pixel.y();
  if (to_geographic_->Transform(1, &x, &y) == 0) return std::nullopt;
  const Geodetic g{radians(y), radians(x), {0.0}};
  return plausible(g) ? std::optional<Geodetic>(g) : std::nullopt;
}

Outcome SurveyFrame::find_extent(double cols, double rows) {
  const Vec2 middle(0.5 * cols, 0.5 * rows);
  const std::optional<Geodetic> datum = geodetic_of(middle);
  if (!datum) return Error{"its centre has no geodetic position"};
  const std::optional<double> undulation = undulation_at(*datum);
  if (!undulation) return Error{"its centre is outside the grid of PROJ: use --undulation"};
  map_.datum = *datum;
  if (undulation_m_ || to_ellipsoid_) map_.undulation_m = *undulation;
  local_.emplace(*datum);
  const auto place = [&](const Vec2& pixel) -> std::optional<Vec2> {
    const std::optional<Geodetic> g = geodetic_of(pixel);
    if (!g) return std::nullopt;
    return Vec2(local_->to_world(*g).head<2>());
  };
  const std::optional<Vec2> east = place(middle + Vec2::UnitX());
  const std::optional<Vec2> south = place(middle + Vec2::UnitY());
  if (!east || !south) return Error{"its centre has no geodetic position"};
  pixel_m_ = std::sqrt(std::abs(east->x() * south->y() - east->y() * south->x()));
  low_ = high_ = Vec2::Zero();
  constexpr int kSteps = 20;
  for (int k = 0; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps;
    for (const Vec2& pixel : {Vec2(share * cols, 0.0), Vec2(share * cols, rows),
                              Vec2(0.0, share * rows), Vec2(cols, share * rows)}) {
      const std::optional<Vec2> p = place(pixel);
      if (!p) return Error{"its border has no geodetic position"};
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

std::optional<Knot> SurveyFrame::knot(const Vec2& place_m) const {
  Knot k;
  for (std::size_t a = 0; a < 2; ++a) {
    const double z = a == 0 ? 0.0 : Knot::kTall_m;
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

void SurveyFrame::to_map(std::vector<double>* x, std::vector<double>* y,
                         std::vector<double>* z) const {
  const std::size_t n = x->size();
  std::vector<int> reached(n);
  const auto count = static_cast<int>(n);
  to_geographic_->Transform(count, x->data(), y->data(), nullptr, reached.data());
  std::vector<double> undulation(n, undulation_m_.value_or(0.0));
  if (!undulation_m_ && to_ellipsoid_) {
    std::vector<double> lon = *x;
    std::vector<double> lat = *y;
    std::vector<int> known(n);
    to_ellipsoid_->Transform(count, lon.data(), lat.data(), undulation.data(), known.data());
    for (std::size_t k = 0; k < n; ++k) reached[k] &= known[k];
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < n; ++k) {
    const Geodetic g{radians((*y)[k]), radians((*x)[k]), {(*z)[k] * unit_m_ + undulation[k]}};
    const Vec3 p = reached[k] != 0 && plausible(g) ? local_->to_world(g) : Vec3::Constant(kNone);
    (*x)[k] = p.x();
    (*y)[k] = p.y();
    (*z)[k] = p.z();
  }
}

}  // namespace rcs::survey
