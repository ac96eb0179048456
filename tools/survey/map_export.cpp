#include "tools/survey/map_export.h"

#include <fmt/format.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>

#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_tile.h"
#include "tools/base/files.h"
#include "tools/survey/gdal_files.h"

namespace rcs::survey {
namespace {

constexpr std::int64_t kMaxCells = std::int64_t{1} << 28;
constexpr float kNoHeight = -32768.0F;

struct Rectangle {
  Cell first;
  std::int64_t width = 0;
  std::int64_t height = 0;
};

Rectangle rectangle_of(const MapLevelIndex& level) {
  Cell low = level.tiles.front().tile;
  Cell high = low;
  for (const MapTileEntry& e : level.tiles) {
    low = {std::min(low.i, e.tile.i), std::min(low.j, e.tile.j)};
    high = {std::max(high.i, e.tile.i), std::max(high.j, e.tile.j)};
  }
  return {first_cell(low), std::int64_t{high.i - low.i + 1} * kTileSide,
          std::int64_t{high.j - low.j + 1} * kTileSide};
}

/// GDAL's rows go from north to south.
template <class F>
Outcome fill_band(const Raster& r, GDALRasterBand* band, const F& value) {
  std::vector<float> row(static_cast<std::size_t>(r.width));
  for (int j = 0; j < r.height; ++j) {
    for (int i = 0; i < r.width; ++i) {
      row[static_cast<std::size_t>(i)] = value(Cell{r.first.i + i, r.first.j + j});
    }
    if (band->RasterIO(GF_Write, 0, r.height - 1 - j, r.width, 1, row.data(), r.width, 1,
                       GDT_Float32, 0, 0, nullptr) != CE_None) {
      return Error{gdal_says()};
    }
  }
  return Done{};
}

Result<Dataset> in_memory(const Raster& r, int bands) {
  register_formats();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("MEM");
  Dataset d(driver == nullptr ? nullptr
                              : driver->Create("", r.width, r.height, bands, GDT_Float32, nullptr));
  if (!d) return Error{gdal_says()};
  const Vec2 corner = r.level.origin_m + r.level.cell_m * Vec2(r.first.i, r.first.j + r.height);
  double affine[6] = {corner.x(), r.level.cell_m, 0.0, corner.y(), 0.0, -r.level.cell_m};
  d->SetGeoTransform(affine);
  d->GetRasterBand(1)->SetNoDataValue(kNoHeight);
  return d;
}

/// The reference frame with this name in the EPSG list; else an unknown one with this name.
OGRSpatialReference geographic_of(const std::string& reference) {
  OGRSpatialReference crs;
  crs.SetGeogCS(reference.c_str(), reference.c_str(), "WGS 84", SRS_WGS84_SEMIMAJOR,
                SRS_WGS84_INVFLATTENING);
  const std::string name = reference == "WGS84" ? "WGS 84" : reference;
  int count = 0;
  OSRCRSInfo** list = OSRGetCRSInfoListFromDatabase("EPSG", nullptr, &count);
  for (int k = 0; k < count; ++k) {
    const OSRCRSInfo& one = *list[k];
    if (one.eType != OSR_CRS_TYPE_GEOGRAPHIC_2D || one.bDeprecated != 0 || name != one.pszName) {
      continue;
    }
    crs.importFromEPSG(std::atoi(one.pszCode));
    break;
  }
  OSRDestroyCRSInfoList(list);
  return crs;
}

}  // namespace

Result<Raster> whole_level(const MapFolder& map, int level) {
  const MapLevelIndex& index = map.index().levels[static_cast<std::size_t>(level)];
  if (index.tiles.empty()) return Error{map.path() + ": the level has no tiles"};
  const Rectangle all = rectangle_of(index);
  if (all.width * all.height > kMaxCells) {
    return Error{
        fmt::format("{}: {} x {} cells of {} m are too many for one raster: choose a "
                    "coarser level",
                    map.path(), all.width, all.height, index.level.cell_m)};
  }
  Raster whole;
  whole.level = index.level;
  whole.first = all.first;
  whole.width = static_cast<int>(all.width);
  whole.height = static_cast<int>(all.height);
  const std::size_t n = whole.cells();
  whole.z_m.assign(n, std::numeric_limits<float>::quiet_NaN());
  whole.sigma_m.assign(n, 1.0F);
  whole.count.assign(n, 0);
  whole.date.assign(n, 0);
  whole.source.assign(n, CellSource::kUnknown);
  std::vector<std::uint8_t> buffer;
  for (const MapTileEntry& e : index.tiles) {
    const Result<Raster> tile = map.read(level, e.tile, &buffer);
    if (!tile) return tile.error();
    for (std::size_t k = 0; k < kTileCells; ++k) {
      const Cell c{tile->first.i + static_cast<int>(k) % kTileSide,
                   tile->first.j + static_cast<int>(k) / kTileSide};
      const std::size_t to = whole.at(c);
      whole.z_m[to] = tile->z_m[k];
      whole.sigma_m[to] = layer_at(tile->sigma_m, k);
      whole.count[to] = layer_at(tile->count, k);
      whole.date[to] = layer_at(tile->date, k);
      whole.source[to] = layer_at(tile->source, k);
    }
  }
  // Crop to the known cells.
  Cell low{1 << 30, 1 << 30};
  Cell high{-(1 << 30), -(1 << 30)};
  for (std::size_t k = 0; k < n; ++k) {
    if (std::isnan(whole.z_m[k])) continue;
    const auto width = static_cast<std::size_t>(whole.width);
    const Cell c{whole.first.i + static_cast<int>(k % width),
                 whole.first.j + static_cast<int>(k / width)};
    low = {std::min(low.i, c.i), std::min(low.j, c.j)};
    high = {std::max(high.i, c.i), std::max(high.j, c.j)};
  }
  if (low.i > high.i) return Error{map.path() + ": no heights in this level"};
  return cut(whole, low, high.i - low.i + 1, high.j - low.j + 1);
}

int level_of_at_most(const MapFolder& map, std::int64_t cells) {
  const auto n = static_cast<int>(map.index().levels.size());
  for (int k = 0; k + 1 < n; ++k) {
    const MapLevelIndex& level = map.index().levels[static_cast<std::size_t>(k)];
    if (level.tiles.empty()) continue;
    const Rectangle all = rectangle_of(level);
    if (all.width * all.height <= cells) return k;
  }
  return n - 1;
}

Outcome write_geotiff(const MapFrame& frame, const Raster& r, const std::string& path) {
  const QuietGdal quiet;
  CPLErrorReset();
  Result<Dataset> memory = in_memory(r, 5);
  if (!memory) return memory.error();
  const bool ellipsoidal = frame.heights == "ellipsoid";
  const LocalFrame local(frame.datum);
  if (ellipsoidal) {
    const OGRSpatialReference geographic = geographic_of(frame.reference);
    OGRSpatialReference crs;
    crs.SetProjCS(("orthographic, " + frame.reference).c_str());
    crs.CopyGeogCSFrom(&geographic);
    crs.SetOrthographic(degrees(frame.datum.lat_rad), degrees(frame.datum.lon_rad), 0.0, 0.0);
    (*memory)->SetSpatialRef(&crs);
  }
  const char* names[] = {"height", "sigma", "count", "days since 2000-01-01",
                         "source (1 survey, 2 aerial, 3 sensed, 4 mixed)"};
  for (int b = 0; b < 5; ++b) (*memory)->GetRasterBand(b + 1)->SetDescription(names[b]);
  Outcome done = fill_band(r, (*memory)->GetRasterBand(1), [&](Cell c) {
    const float z = r.z_m[r.at(c)];
    if (std::isnan(z)) return kNoHeight;
    if (!ellipsoidal) return z;
    const Vec2 p = r.level.centre(c);
    return static_cast<float>(local.to_geodetic({p.x(), p.y(), z}).height.m);
  });
  const auto band = [&](int number, const auto& layer) {
    if (!done) return;
    done = fill_band(r, (*memory)->GetRasterBand(number),
                     [&](Cell c) { return static_cast<float>(layer_at(layer, r.at(c))); });
  };
  band(2, r.sigma_m);
  band(3, r.count);
  band(4, r.date);
  band(5, r.source);
  if (!done) return Error{path + ": " + done.error().message};
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  // The compressed size is not known in advance.
  char* options[] = {const_cast<char*>("COMPRESS=DEFLATE"), const_cast<char*>("BIGTIFF=IF_SAFER"),
                     nullptr};
  CPLErrorReset();
  Dataset written(driver == nullptr
                      ? nullptr
                      : driver->CreateCopy(kInMemory, memory->get(), 0, options, nullptr, nullptr));
  return close_and_write(std::move(written), path);
}

Outcome write_hillshade(const Raster& r, const std::string& path) {
  const QuietGdal quiet;
  CPLErrorReset();
  Result<Dataset> memory = in_memory(r, 1);
  if (!memory) return memory.error();
  const Outcome filled = fill_band(r, (*memory)->GetRasterBand(1), [&](Cell c) {
    const float z = r.z_m[r.at(c)];
    return std::isnan(z) ? kNoHeight : z;
  });
  if (!filled) return Error{path + ": " + filled.error().message};
  char* arguments[] = {const_cast<char*>("-of"), const_cast<char*>("PNG"),
                       const_cast<char*>("-compute_edges"), nullptr};
  CPLErrorReset();
  GDALDEMProcessingOptions* options = GDALDEMProcessingOptionsNew(arguments, nullptr);
  int misused = 0;
  Dataset written(static_cast<GDALDataset*>(
      GDALDEMProcessing(kInMemory, memory->get(), "hillshade", nullptr, options, &misused)));
  GDALDEMProcessingOptionsFree(options);
  return close_and_write(std::move(written), path);
}

}  // namespace rcs::survey
