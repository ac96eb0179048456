// rcs map: merge, diff

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/mapping/merge.h"
#include "tools/mapping/resample.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"
#include "tools/survey/map_difference.h"
#include "tools/survey/map_export.h"

namespace rcs::cli {
namespace {

using report::Json;

class MapMerge final : public Command {
 public:
  explicit MapMerge(CLI::App* map)
      : Command(map->add_subcommand("merge", "Merge maps of several surveys of the same ground")) {
    constexpr int kMaxMaps = 100;
    app()
        ->add_option("MAPS", maps_, "two or more map folders; the first defines frame and cells")
        ->type_name("FOLDER")
        ->required()
        ->expected(2, kMaxMaps);
    app()
        ->add_option("-o,--out", out_, "folder of the map; an existing map is replaced")
        ->type_name("FOLDER")
        ->required();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The height of a cell is the mean of the surveys, weighted by their inverse variances\n"
        "(sigma and systematic error), and its sigma is that of the mean. Counts are added, the\n"
        "newest date is kept, different sources become mixed. Where surveys differ by more than\n"
        "four sigma, the newest is kept (the one with the smallest sigma, if dates are equal or\n"
        "unknown). Surveys must be independent: one that is in two of the maps counts twice.\n"
        "Surface points of trunks and walls are not merged.\n"
        "Example:\n  rcs map merge maps/lidar maps/srtm -o maps/valley");
  }

  int run() override {
    constexpr std::string_view kMapCompareName = "map merge";
    const InterruptGuard interrupt;
    Result<mapping::Merged> done = Error{""};
    {
      Progress progress(kMapCompareName, Progress::kSteps);
      done = mapping::merge_maps(maps_, out_, [&](double share) {
        progress.at(static_cast<std::int64_t>(share * Progress::kSteps));
        return !interrupt.requested();
      });
    }
    if (!done) return fail(kMapCompareName, done.error());
    if (json_) {
      const Json json = {{"map", out_},
                         {"reference", done->frame.reference},
                         {"heights_above", done->frame.heights},
                         {"cell_m", done->cell_m},
                         {"cells", done->cells},
                         {"cells_in_several_maps", done->several},
                         {"cells_that_contradict", done->changed},
                         {"surface_points_not_merged", done->points_lost}};
      fmt::print("{}", report::json_document(kMapCompareName, json));
      return kExitOk;
    }
    fmt::print(stderr,
               "rcs {}: {}: {} cells of {:g} m, in {}, heights above {}; {} cells in several maps, "
               "of which {} contradict each other\n",
               kMapCompareName, out_, done->cells, done->cell_m, done->frame.reference,
               done->frame.heights, done->several, done->changed);
    if (done->points_lost > 0) {
      fmt::print(stderr, "rcs {}: {} surface points are not merged into {}\n", kMapCompareName,
                 done->points_lost, out_);
    }
    return kExitOk;
  }

 private:
  std::vector<std::string> maps_;
  std::string out_;
  bool json_ = false;
};

class MapDiff final : public Command {
 public:
  explicit MapDiff(CLI::App* map)
      : Command(map->add_subcommand(
            "diff", "Compare two maps of the same ground, and the differences with their sigmas")) {
    app()
        ->add_option("A", a_, "folder of a map; its finest cells are compared")
        ->type_name("FOLDER")
        ->required();
    app()
        ->add_option("B", b_, "folder of the other map; differences are B - A")
        ->type_name("FOLDER")
        ->required();
    app()
        ->add_option(
            "--picture", picture_,
            "write a PNG file of a level of at most 4 million cells: white where the maps agree, "
            "red where B is higher, blue where B is lower")
        ->type_name("FILE");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "For normal errors 68.3 % of the differences are within one sigma and 95.4 % within two.\n"
        "Lower shares mean that the sigmas are too small (or that the ground has changed).\n"
        "Example:\n  rcs map diff maps/lidar maps/srtm --picture diff.png");
  }

  int run() override {
    constexpr std::string_view kMapCompareName = "map diff";
    constexpr std::int64_t kPicture = 4'000'000;
    const Result<MapFolder> a = MapFolder::open(a_);
    if (!a) return fail(kMapCompareName, a.error());
    const InterruptGuard interrupt;
    const double cell_m = a->index().levels.front().level.cell_m;
    Result<mapping::MapResampler> b = mapping::MapResampler::open(b_, *a, cell_m);
    if (!b) return fail(kMapCompareName, b.error());
    Result<survey::MapDifference> d = survey::MapDifference();
    {
      Progress progress(kMapCompareName, Progress::kSteps);
      d = survey::difference_of(*a, 0, &*b, going(&progress, interrupt));
    }
    if (!d) return fail(kMapCompareName, d.error());
    constexpr double kMin_m = 0.001;  // of equal maps the picture is white
    const double range_m = std::max(kMin_m, std::abs(d->median_m) + 3.0 * d->nmad_m);
    if (!picture_.empty()) {
      const int level = survey::level_of_at_most(*a, kPicture);
      const double coarser_m = a->index().levels[static_cast<std::size_t>(level)].level.cell_m;
      b = mapping::MapResampler::open(b_, *a, coarser_m);
      if (!b) return fail(kMapCompareName, b.error());
      Result<Raster> raster = Error{""};
      {
        Progress progress("picture", Progress::kSteps);
        raster = survey::difference_raster(*a, level, &*b, going(&progress, interrupt));
      }
      if (!raster) return fail(kMapCompareName, raster.error());
      const Outcome done = survey::write_difference(*raster, range_m, picture_);
      if (!done) return fail(kMapCompareName, done.error());
    }
    print_results(*d, cell_m, range_m);
    return kExitOk;
  }

 private:
  [[nodiscard]] static survey::Going going(Progress* progress, const InterruptGuard& interrupt) {
    return [progress, &interrupt](double share) {
      progress->at(static_cast<std::int64_t>(share * Progress::kSteps));
      return !interrupt.requested();
    };
  }

  void print_results(const survey::MapDifference& d, double cell_m, double range_m) const {
    if (json_) {
      Json json = {{"cells", d.cells},
                   {"cell_m", cell_m},
                   {"mean_m", d.mean_m},
                   {"median_m", d.median_m},
                   {"rms_m", d.rms_m},
                   {"nmad_m", d.nmad_m},
                   {"p95_abs_m", d.p95_m},
                   {"within_sigma", {{"one", d.by_sigma.one}, {"two", d.by_sigma.two}}},
                   {"within_sigma_and_bias", {{"one", d.with_bias.one}, {"two", d.with_bias.two}}}};
      if (!picture_.empty()) json["picture_range_m"] = range_m;
      fmt::print("{}", report::json_document("map diff", json));
      return;
    }
    const auto metres = [](double v) { return fmt::format("{:.3f}", v); };
    const auto percent = [](double v) { return fmt::format("{:.1f}", 100.0 * v); };
    report::Table differences{
        {"B - A", "cells", "mean [m]", "median [m]", "RMS [m]", "NMAD [m]", "95 % of |d| [m]"},
        {{fmt::format("cells of {:g} m", cell_m), std::to_string(d.cells), metres(d.mean_m),
          metres(d.median_m), metres(d.rms_m), metres(d.nmad_m), metres(d.p95_m)}}};
    differences.note =
        "NMAD: 1.4826 times the median of |d - median|, a robust standard deviation; d: B - A";
    const report::Table expected{
        {"within", "1 sigma [%]", "2 sigma [%]"},
        {{"sigma of both maps", percent(d.by_sigma.one), percent(d.by_sigma.two)},
         {"with systematic errors", percent(d.with_bias.one), percent(d.with_bias.two)},
         {"expected (normal errors)", "68.3", "95.4"}}};
    fmt::print("{}\n{}", to_text(differences), to_text(expected));
    if (picture_.empty()) return;
    fmt::print("{}: white 0, blue -{:.3f} m and below, red {:.3f} m and above\n", picture_, range_m,
               range_m);
  }

  std::string a_;
  std::string b_;
  std::string picture_;
  bool json_ = false;
};

}  // namespace

void add_map_compare_commands(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapMerge>(map));
  commands->push_back(std::make_unique<MapDiff>(map));
}

}  // namespace rcs::cli
