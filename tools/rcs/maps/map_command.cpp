// rcs map: info, export

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tools/base/files.h"
#include "tools/mapping/survey_date.h"
#include "tools/rcs/command.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"
#include "tools/survey/map_export.h"

namespace rcs::cli {
namespace {

using report::Json;

constexpr const char* kSourceNames[] = {"unknown", "survey", "aerial", "sensed", "mixed"};
class MapInfo final : public Command {
 public:
  explicit MapInfo(CLI::App* map)
      : Command(map->add_subcommand("info", "Print position, resolution and accuracy of a map")) {
    app()->add_option("MAP", path_, "folder of the map")->type_name("FOLDER")->required();
    app()->add_flag("--check", check_,
                    "read every tile and print sigma, sources and dates; exit status 1 if a tile "
                    "is broken");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer("Example:\n  rcs map info maps/valley --check");
  }

  int run() override {
    const Result<MapFolder> map = MapFolder::open(path_);
    if (!map) return fail("map info", map.error());
    const MapFrame& f = map->index().frame;
    Json json = {{"datum",
                  {{"lat_deg", degrees(f.datum.lat_rad)},
                   {"lon_deg", degrees(f.datum.lon_rad)},
                   {"height_m", f.datum.height.m}}},
                 {"reference", f.reference},
                 {"heights_above", f.heights},
                 {"undulation_m", std::isnan(f.undulation_m) ? Json() : Json(f.undulation_m)},
                 {"source_crs", f.source_crs},
                 {"levels", Json::array()}};
    report::Table table{
        {"level", "cell [m]", "tiles", "km2 known", "east [m]", "north [m]", "z [m]", "points"},
        {}};
    if (check_) {
      for (const char* name : {"sigma, median [m]", "sources", "dates"}) {
        table.header.emplace_back(name);
      }
    }
    std::int64_t broken = 0;
    for (std::size_t k = 0; k < map->index().levels.size(); ++k) {
      Json level = level_json(*map, static_cast<int>(k), &broken);
      table.rows.push_back(row_of(level, static_cast<int>(k)));
      json["levels"].push_back(std::move(level));
    }
    if (check_) json["broken"] = broken;
    if (json_) {
      fmt::print("{}", report::json_document("map info", json));
    } else {
      fmt::print("datum: {:.7f} deg N, {:.7f} deg E, {:.2f} m; reference frame {}\n",
                 degrees(f.datum.lat_rad), degrees(f.datum.lon_rad), f.datum.height.m, f.reference);
      fmt::print("heights: above {}{}; from: {}\n", f.heights,
                 std::isnan(f.undulation_m)
                     ? ""
                     : fmt::format(" (the geoid is {:.2f} m above it)", f.undulation_m),
                 f.source_crs);
      table.note =
          "known: with a height; east, north, z: extent in the frame of the map; points: surface "
          "points of above-ground structure";
      fmt::print("{}", to_text(table));
      if (check_) fmt::print("broken tiles: {}\n", broken);
    }
    return broken == 0 ? kExitOk : kExitNegative;
  }

 private:
  Json level_json(const MapFolder& map, int number, std::int64_t* broken) const {
    const MapLevelIndex& level = map.index().levels[static_cast<std::size_t>(number)];
    std::int64_t known = 0;
    std::int64_t points = 0;
    float low_m = std::numeric_limits<float>::max();
    float high_m = std::numeric_limits<float>::lowest();
    Vec2 south_west = Vec2::Constant(1e12);
    Vec2 north_east = -south_west;
    const double side_m = level.level.cell_m * kTileSide;
    for (const MapTileEntry& e : level.tiles) {
      known += e.known;
      points += e.points;
      low_m = std::min(low_m, e.low_m);
      high_m = std::max(high_m, e.high_m);
      const Vec2 corner = level.level.origin_m + side_m * Vec2(e.tile.i, e.tile.j);
      south_west = south_west.cwiseMin(corner);
      north_east = north_east.cwiseMax(corner + Vec2::Constant(side_m));
    }
    Json json = {
        {"cell_m", level.level.cell_m},
        {"bias_sigma_m", level.level.bias_sigma_m},
        {"bias_correlation_m", level.level.bias_correlation_m},
        {"tiles", level.tiles.size()},
        {"known_cells", known},
        {"surface_points", points},
        {"known_km2", 1e-6 * static_cast<double>(known) * level.level.cell_m * level.level.cell_m},
        {"east_m", {south_west.x(), north_east.x()}},
        {"north_m", {south_west.y(), north_east.y()}},
        {"z_m", {low_m, high_m}}};
    if (!check_) return json;
    std::vector<float> sigmas;
    std::map<std::string, std::int64_t> sources;
    int oldest = 65535;
    int newest = 0;
    std::vector<std::uint8_t> buffer;
    for (const MapTileEntry& e : level.tiles) {
      const Result<Raster> tile = map.read(number, e.tile, &buffer);
      if (!tile) {
        fmt::print(stderr, "rcs map info: {}\n", tile.error().message);
        ++*broken;
        continue;
      }
      for (std::size_t k = 0; k < kTileCells; ++k) {
        if (std::isnan(tile->z_m[k])) continue;
        sigmas.push_back(layer_at(tile->sigma_m, k));
        ++sources[kSourceNames[static_cast<int>(layer_at(tile->source, k))]];
        const int date = layer_at(tile->date, k);
        if (date == 0) continue;
        oldest = std::min(oldest, date);
        newest = std::max(newest, date);
      }
    }
    if (!sigmas.empty()) {
      const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
      std::nth_element(sigmas.begin(), middle, sigmas.end());
      json["sigma_median_m"] = *middle;
    }
    json["sources"] = sources;
    json["dates"] =
        newest == 0 ? Json::array() : Json{mapping::date_text(oldest), mapping::date_text(newest)};
    return json;
  }

  [[nodiscard]] std::vector<std::string> row_of(const Json& level, int number) const {
    const auto span = [&level](const char* key) {
      // + 0.0: no "-0".
      return fmt::format("{:.0f} to {:.0f}", std::round(level[key][0].get<double>()) + 0.0,
                         std::round(level[key][1].get<double>()) + 0.0);
    };
    std::vector<std::string> row = {std::to_string(number),
                                    fmt::format("{:.4g}", level["cell_m"].get<double>()),
                                    std::to_string(level["tiles"].get<std::int64_t>()),
                                    fmt::format("{:.3f}", level["known_km2"].get<double>()),
                                    span("east_m"),
                                    span("north_m"),
                                    span("z_m"),
                                    std::to_string(level["surface_points"].get<std::int64_t>())};
    if (!check_) return row;
    row.push_back(level.contains("sigma_median_m")
                      ? fmt::format("{:.2f}", level["sigma_median_m"].get<double>())
                      : "-");
    std::string sources;
    for (const auto& [name, cells] : level["sources"].items()) {
      sources += (sources.empty() ? "" : ", ") + name;
    }
    row.push_back(sources);
    row.push_back(level["dates"].empty() ? "unknown"
                                         : level["dates"][0].get<std::string>() + " to " +
                                               level["dates"][1].get<std::string>());
    return row;
  }

  std::string path_;
  bool check_ = false;
  bool json_ = false;
};

class MapExport final : public Command {
 public:
  explicit MapExport(CLI::App* map)
      : Command(map->add_subcommand("export", "Export a map as a GeoTIFF or a hillshade image")) {
    app()->add_option("MAP", path_, "folder of the map")->type_name("FOLDER")->required();
    app()
        ->add_option("--geotiff", geotiff_,
                     "write a GeoTIFF file with the bands height, sigma, count, date, source")
        ->type_name("FILE");
    app()
        ->add_option("--hillshade", hillshade_, "write a PNG file of the relief")
        ->type_name("FILE");
    app()->add_option("--level", level_,
                      "level of the map, 0 is the finest; default: 0 for the GeoTIFF, the finest "
                      "level of at most 4 "
                      "million cells for the image");
    app()->footer(
        "Example:\n  rcs map export maps/valley --hillshade valley.png --geotiff valley.tif");
  }

  int run() override {
    constexpr std::string_view kMapName = "map export";
    constexpr std::int64_t kPicture = 4'000'000;
    if (geotiff_.empty() && hillshade_.empty()) {
      fmt::print(stderr, "rcs {}: --geotiff or --hillshade is required\n", kMapName);
      return kExitUsage;
    }
    const Result<MapFolder> map = MapFolder::open(path_);
    if (!map) return fail(kMapName, map.error());
    const auto levels = static_cast<int>(map->index().levels.size());
    if (level_ >= levels) {
      return fail(kMapName,
                  Error{fmt::format("--level {}: the map has levels 0 to {}", level_, levels - 1)});
    }
    const auto level_or = [this](int standard) { return level_ < 0 ? standard : level_; };
    if (!geotiff_.empty()) {
      const Result<Raster> raster = survey::whole_level(*map, level_or(0));
      if (!raster) return fail(kMapName, raster.error());
      const Outcome done = survey::write_geotiff(map->index().frame, *raster, geotiff_);
      if (!done) return fail(kMapName, done.error());
    }
    if (!hillshade_.empty()) {
      const Result<Raster> raster =
          survey::whole_level(*map, level_or(survey::level_of_at_most(*map, kPicture)));
      if (!raster) return fail(kMapName, raster.error());
      const Outcome done = survey::write_hillshade(*raster, hillshade_);
      if (!done) return fail(kMapName, done.error());
    }
    return kExitOk;
  }

 private:
  std::string path_;
  std::string geotiff_;
  std::string hillshade_;
  int level_ = -1;
};

}  // namespace

void add_map_commands(CLI::App* rcs, Commands* commands) {
  CLI::App* map =
      rcs->add_subcommand("map", "Create, inspect, compare and use a priori terrain maps");
  map->require_subcommand(1);
  add_map_import_commands(map, commands);
  commands->push_back(std::make_unique<MapInfo>(map));
  commands->push_back(std::make_unique<MapExport>(map));
  add_map_build_command(map, commands);
  add_map_match_command(map, commands);
  add_map_locate_command(map, commands);
  add_map_localizability_command(map, commands);
  add_map_compare_commands(map, commands);
  add_map_study_command(map, commands);
}

}  // namespace rcs::cli
