// rcs map import: raster, cloud, av2

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "tools/mapping/map_writer.h"
#include "tools/mapping/survey_date.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/survey/cloud_import.h"
#include "tools/survey/npy_raster.h"
#include "tools/survey/raster_import.h"

namespace rcs::cli {
namespace {

const std::map<std::string, CellSource> kSources = {{"survey", CellSource::kSurvey},
                                                    {"aerial", CellSource::kAerial},
                                                    {"sensed", CellSource::kSensed}};

/// Options of every import.
class SurveyOptions {
 public:
  explicit SurveyOptions(CLI::App* app) {
    app->add_option("-o,--out", out_, "folder of the map; an existing map is replaced")
        ->type_name("FOLDER")
        ->required();
    app->add_option("--sigma", quality_.sigma_m,
                    "sigma of the heights of the survey [m] without systematic error, from its "
                    "data sheet")
        ->required()
        ->check(CLI::Range(0.001, 1000.0));
    app->add_option("--bias-sigma", quality_.bias_sigma_m, "sigma of the systematic error [m]")
        ->check(CLI::Range(0.0, 1000.0))
        ->capture_default_str();
    app->add_option("--bias-length", quality_.bias_correlation_m,
                    "correlation length of the systematic error [m]")
        ->check(CLI::Range(1.0, 1e7))
        ->capture_default_str();
    app->add_option("--date", date_,
                    "date of the survey: YYYY-MM-DD, from 2000 on; default: unknown")
        ->type_name("DATE");
    app->add_option("--source", source_, "survey: measured on the ground; aerial: from the air")
        ->check(CLI::IsMember({"survey", "aerial"}))
        ->capture_default_str();
    app->add_flag("--json", json_, "print the results as JSON");
  }
  [[nodiscard]] Result<survey::SurveyQuality> quality() const {
    survey::SurveyQuality q = quality_;
    if (!date_.empty()) {
      q.date = mapping::parse_date(date_);
      if (q.date == 0) return Error{"--date: " + date_ + ": expected YYYY-MM-DD from 2000 on"};
    }
    return q;
  }
  [[nodiscard]] const std::string& out() const { return out_; }
  [[nodiscard]] bool json() const { return json_; }
  [[nodiscard]] CellSource source() const { return kSources.at(source_); }

 private:
  std::string out_;
  survey::SurveyQuality quality_;
  std::string date_;
  std::string source_ = "aerial";
  bool json_ = false;
};

/// Options of imports with geodetic coordinates.
class CoordinateOptions {
 public:
  CoordinateOptions(CLI::App* app, survey::SurveyCoordinates* wanted) : wanted_(wanted) {
    app->add_option("--crs", wanted->crs,
                    "EPSG code or PROJ text of the coordinates, if missing or wrong in the file");
    app->add_option("--heights", wanted->heights,
                    "reference of the heights: ellipsoid, EGM96, EGM2008, EPSG:5703, ...; "
                    "default: from the coordinate reference system");
    app->add_option("--undulation", undulation_m_,
                    "height of the geoid above the ellipsoid [m], if PROJ has no grid for "
                    "--heights")
        ->check(CLI::Range(-120.0, 120.0));
    app->add_option("--height-unit", wanted->height_unit_m,
                    "unit of the heights in metres; default: from the band of the raster, else "
                    "from the vertical system of the file or of --heights, else 1")
        ->check(CLI::Range(1e-4, 1000.0));
  }
  void finish() {
    if (!std::isnan(undulation_m_)) wanted_->undulation_m = undulation_m_;
  }

 private:
  survey::SurveyCoordinates* wanted_;
  double undulation_m_ = std::numeric_limits<double>::quiet_NaN();
};

report::Json json_of(const std::string& map, const MapFrame& frame, double cell_m,
                     std::int64_t known) {
  return {{"map", map},
          {"reference", frame.reference},
          {"heights_above", frame.heights},
          {"undulation_m",
           std::isnan(frame.undulation_m) ? report::Json() : report::Json(frame.undulation_m)},
          {"cell_m", cell_m},
          {"cells", known}};
}

void print_written(const std::string& map, const MapFrame& frame, double cell_m,
                   std::int64_t known) {
  fmt::print(
      stderr, "rcs map: {}: {} cells of {:g} m, in {}, heights above {}{}\n", map, known, cell_m,
      frame.reference, frame.heights,
      std::isnan(frame.undulation_m)
          ? ""
          : fmt::format(" (the geoid is {:.2f} m above it at the datum)", frame.undulation_m));
}

class MapImportRaster final : public Command {
 public:
  explicit MapImportRaster(CLI::App* import)
      : Command(import->add_subcommand("raster", "Import an elevation raster")),
        survey_(app()),
        coordinates_(app(), &wanted_) {
    app()
        ->add_option("FILE", wanted_.path,
                     fmt::format("{} [heights in metres]", survey::kRasterFormats))
        ->required()
        ->check(CLI::ExistingFile);
    app()->add_option("--band", wanted_.band, "band of the file")->capture_default_str();
    app()->add_option("--nodata", nodata_, "value without data; default: from the file");
    app()
        ->add_option("--cell", wanted_.cell_m,
                     "cell size of the map [m]; default: spacing of the raster")
        ->check(CLI::Range(0.01, 10000.0));
    app()->footer(
        "Heights are converted to heights above the ellipsoid, in the geodetic reference frame of\n"
        "the file (WGS84, NAD83, ...). The configuration of the vehicle must name the same frame\n"
        "([world] reference_frame). The sigma of a cell includes the interpolation error between\n"
        "the nodes of the raster.\n"
        "Examples:\n"
        "  rcs map import raster srtm.tif --heights EGM96 --sigma 5 --bias-sigma 3 -o maps/valley\n"
        "  rcs map import raster dem.asc --crs EPSG:32613 --heights EGM96 --sigma 0.3 -o "
        "maps/hill");
  }

  int run() override {
    constexpr std::string_view kMapImportName = "map import raster";
    const Result<survey::SurveyQuality> quality = survey_.quality();
    if (!quality) return wrong_usage(kMapImportName, quality.error());
    wanted_.quality = *quality;
    wanted_.source = survey_.source();
    coordinates_.finish();
    if (!std::isnan(nodata_)) wanted_.nodata = nodata_;
    const InterruptGuard interrupt;
    Progress progress(kMapImportName, Progress::kSteps);
    const Result<survey::RasterImported> done =
        survey::import_raster(wanted_, survey_.out(), [&](double share) {
          progress.at(static_cast<std::int64_t>(share * Progress::kSteps));
          return !interrupt.requested();
        });
    if (!done) return fail(kMapImportName, done.error());
    if (survey_.json()) {
      report::Json json = json_of(survey_.out(), done->frame, done->cell_m, done->known);
      json["unknown_cells"] = done->unknown;
      fmt::print("{}", report::json_document(kMapImportName, json));
    } else {
      print_written(survey_.out(), done->frame, done->cell_m, done->known);
    }
    return kExitOk;
  }

 private:
  SurveyOptions survey_;
  survey::RasterImport wanted_;
  CoordinateOptions coordinates_;
  double nodata_ = std::numeric_limits<double>::quiet_NaN();
};

class MapImportCloud final : public Command {
 public:
  explicit MapImportCloud(CLI::App* import)
      : Command(import->add_subcommand("cloud", "Import the ground of a surveyed point cloud")),
        survey_(app()),
        coordinates_(app(), &wanted_) {
    constexpr int kMaxFiles = 100'000;
    app()
        ->add_option("FILE", wanted_.paths,
                     "files of one survey: .las (1.2 to 1.4, not compressed), .xyz or .txt (one "
                     "point per line: x y z ...), .pcd, .ply")
        ->required()
        ->expected(1, kMaxFiles)
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--cell", wanted_.cell_m,
                     "cell size of the map [m]; default: the smallest of 0.25, 0.5, 1, 2, 5, ... "
                     "100 that contains at least 3.5 points on average")
        ->check(CLI::Range(0.05, 100.0));
    app()
        ->add_option("--class-column", wanted_.class_column,
                     "column of the class in .xyz and .txt, counted from 1")
        ->check(CLI::Range(4, 100));
    CLI::Option* classes = add_list(app(), "--ground", &wanted_.ground_classes, "classes of ground")
                               ->check(CLI::Range(0, 255))
                               ->capture_default_str();
    app()
        ->add_flag("--ignore-classes", wanted_.ignore_classes,
                   "detect the ground by its shape even if points have classes")
        ->excludes(classes);
    app()
        ->add_option("--slope", wanted_.bare_earth.slope,
                     "detection by shape: objects steeper than this are not ground [1]")
        ->check(CLI::Range(0.01, 5.0))
        ->capture_default_str();
    app()
        ->add_option("--largest", wanted_.bare_earth.largest_m,
                     "detection by shape: half the width of the largest building [m]")
        ->check(CLI::Range(1.0, 200.0))
        ->capture_default_str();
    app()
        ->add_option("--memory", memory_mb_, "memory limit [MB]")
        ->check(CLI::Range(10.0, 1e6))
        ->capture_default_str();
    app()->footer(
        "Ground are the points of class 2 and 8 (key points). Water (9) is excluded because its\n"
        "level changes, and lakes become holes; --ground 2,8,9 includes it. Points flagged as\n"
        "withheld and noise (7, 18) are skipped. If no point has such a class, the ground is\n"
        "detected by its shape (Pingel and others, 2013), which removes sharp ridges and cliffs "
        "and\n"
        "keeps objects lower than --slope and 0.5 m. A cell without a ground point is a hole; a\n"
        "larger --cell gives fewer holes. Holes, few points per cell, repeated points, equal "
        "heights\n"
        "and an implausible extent are reported as warnings. Heights are converted to heights "
        "above\n"
        "the ellipsoid, in the geodetic reference frame of the survey (WGS84, NAD83, ...). The\n"
        "configuration of the vehicle must name the same frame ([world] reference_frame).\n"
        "Examples:\n"
        "  rcs map import cloud tiles/*.las --heights ellipsoid --sigma 0.1 -o maps/forest\n"
        "  rcs map import cloud hill.xyz --class-column 7 --crs EPSG:32618 --undulation -33.2\n"
        "    --sigma 0.1 --cell 2 --date 2019-06-30 -o maps/hill");
  }

  int run() override {
    constexpr std::string_view kMapImportName = "map import cloud";
    const Result<survey::SurveyQuality> quality = survey_.quality();
    if (!quality) return wrong_usage(kMapImportName, quality.error());
    wanted_.quality = *quality;
    wanted_.source = survey_.source();
    wanted_.memory_bytes = 1e6 * memory_mb_;
    coordinates_.finish();
    const InterruptGuard interrupt;
    Progress progress(kMapImportName, Progress::kSteps);
    const Result<survey::CloudImported> done =
        survey::import_cloud(wanted_, survey_.out(), [&](double share) {
          progress.at(static_cast<std::int64_t>(share * Progress::kSteps));
          return !interrupt.requested();
        });
    if (!done) return fail(kMapImportName, done.error());
    if (survey_.json()) {
      report::Json json = json_of(survey_.out(), done->frame, done->cell_m, done->ground.cells);
      json.update(points_json(*done));
      fmt::print("{}", report::json_document(kMapImportName, json));
    } else {
      print_points(*done);
      print_written(survey_.out(), done->frame, done->cell_m, done->ground.cells);
    }
    for (const std::string& warning :
         survey::density_warnings(done->density, done->cell_m, done->ground.cells)) {
      fmt::print(stderr, "rcs map: warning: {}\n", warning);
    }
    return kExitOk;
  }

 private:
  static report::Json points_json(const survey::CloudImported& c) {
    return {{"points", c.points},
            {"ground", c.ground.points},
            {"ground_detected_by", c.by_classes ? "class" : "shape"},
            {"not_ground", c.not_ground},
            {"withheld_or_not_finite", c.invalid},
            {"noise", c.noise},
            {"outside_of_projection", c.unplaced},
            {"within_cell_median_m", c.ground.within_cell_median_m},
            {"sigma_median_m", c.ground.sigma_median_m},
            {"points_per_m2", c.density.points_per_m2},
            {"surveyed_m2", c.density.surveyed_m2}};
  }

  void print_points(const survey::CloudImported& c) const {
    fmt::print(stderr,
               "rcs map: cell {:g} m ({}): {:.2g} points per m2 in the surveyed area of {:.3g} m2, "
               "{:.2g} per cell\n",
               c.cell_m,
               wanted_.cell_m > 0.0 ? "--cell" : "the smallest with at least 3.5 points on average",
               c.density.points_per_m2, c.density.surveyed_m2,
               c.density.points_per_m2 * c.cell_m * c.cell_m);
    fmt::print(stderr,
               "rcs map: {} points: {} ground (detected by {}), {} not ground; {} flagged as "
               "withheld or not finite, {} noise{}\n",
               c.points, c.ground.points, c.by_classes ? "class" : "shape", c.not_ground, c.invalid,
               c.noise,
               c.unplaced == 0 ? ""
                               : fmt::format(", {} outside the area of the projection or the "
                                             "geoid grid",
                                             c.unplaced));
    fmt::print(stderr,
               "rcs map: standard deviation within a cell {:.3f} m, sigma {:.3f} m (medians)\n",
               c.ground.within_cell_median_m, c.ground.sigma_median_m);
  }

  SurveyOptions survey_;
  survey::CloudImport wanted_;
  CoordinateOptions coordinates_;
  double memory_mb_ = 4000.0;
};

class MapImportAv2 final : public Command {
 public:
  explicit MapImportAv2(CLI::App* import)
      : Command(import->add_subcommand("av2", "Import the ground heights of an Argoverse 2 log")),
        survey_(app()) {
    app()
        ->add_option("FOLDER", folder_, "folder of the log, or its sub-folder `map`")
        ->required()
        ->check(CLI::ExistingDirectory);
    app()->footer(
        "The map is in the frame of the city (reference AV2-PIT, ...), not in a global frame.\n"
        "Example:\n"
        "  rcs map import av2 7fab2350-7eaf-3b7e-a39d-6937a4c1bede --sigma 0.05 -o maps/street");
  }

  int run() override {
    constexpr std::string_view kMapImportName = "map import av2";
    const Result<survey::SurveyQuality> quality = survey_.quality();
    if (!quality) return wrong_usage(kMapImportName, quality.error());
    Result<survey::ImportedRaster> read = survey::import_av2(folder_, *quality);
    if (!read) return fail(kMapImportName, read.error());
    read->raster.source = {survey_.source()};
    if (Outcome written = mapping::write_map(survey_.out(), read->frame, read->raster); !written) {
      return fail(kMapImportName, written.error());
    }
    const auto known = std::count_if(read->raster.z_m.begin(), read->raster.z_m.end(),
                                     [](float z) { return !std::isnan(z); });
    const double cell_m = read->raster.level.cell_m;
    if (survey_.json()) {
      const report::Json json = json_of(survey_.out(), read->frame, cell_m, known);
      fmt::print("{}", report::json_document(kMapImportName, json));
    } else {
      print_written(survey_.out(), read->frame, cell_m, known);
    }
    return kExitOk;
  }

 private:
  SurveyOptions survey_;
  std::string folder_;
};

}  // namespace

void add_map_import_commands(CLI::App* map, Commands* commands) {
  CLI::App* import = map->add_subcommand("import", "Create a map from a survey");
  import->require_subcommand(1);
  commands->push_back(std::make_unique<MapImportRaster>(import));
  commands->push_back(std::make_unique<MapImportCloud>(import));
  commands->push_back(std::make_unique<MapImportAv2>(import));
}

}  // namespace rcs::cli
