// rcs map localizability

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rcs/terrain/localizability.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tools/base/files.h"
#include "tools/base/random_places.h"
#include "tools/rcs/command.h"
#include "tools/rcs/maps/map_memory.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/report/svg_plot.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

using report::Json;

constexpr std::string_view kMapLocalizabilityName = "map localizability";
constexpr double kPlaces = 120.0;     // along the longer side, without --step
constexpr double kMaxPlaces = 4e6;    // limit of the number of positions with --step
constexpr double kCoarsest_m = 10.0;  // end of the colour scale
constexpr std::array kLimits_m = {0.1, 0.3, 1.0, 3.0, 10.0};

struct Place {
  int i = 0;  // in steps
  int j = 0;
  double sigma_m = 0.0;  // infinite if a direction is unobserved
};

/// The rectangle of a map's tiles, in its frame.
struct Extent {
  Vec2 low_m = Vec2::Constant(std::numeric_limits<double>::infinity());
  Vec2 high_m = -low_m;
};

Extent extent_of(const MapIndex& index) {
  Extent e;
  for (const MapLevelIndex& level : index.levels) {
    for (const MapTileEntry& entry : level.tiles) {
      const Cell first = first_cell(entry.tile);
      const Cell last{first.i + kTileSide - 1, first.j + kTileSide - 1};
      e.low_m = e.low_m.cwiseMin(level.level.centre(first));
      e.high_m = e.high_m.cwiseMax(level.level.centre(last));
    }
  }
  return e;
}

/// The rectangle of the known cells, with a resolution of 1/300: tiles are rarely full.
Extent known_part(const ElevationMap& map, const Extent& tiles) {
  constexpr int kSamples = 300;  // samples along each axis
  const Vec2 step = (tiles.high_m - tiles.low_m) / kSamples;
  Extent e;
  for (int j = 0; j < kSamples; ++j) {
    for (int i = 0; i < kSamples; ++i) {
      const Vec2 low = tiles.low_m + Vec2(i, j).cwiseProduct(step);
      const Vec2 middle = low + 0.5 * step;
      Elevation known;
      if (!map.sample(middle.x(), middle.y(), &known)) continue;
      e.low_m = e.low_m.cwiseMin(low);
      e.high_m = e.high_m.cwiseMax(low + step);
    }
  }
  return e;
}

class MapLocalizability final : public Command {
 public:
  explicit MapLocalizability(CLI::App* map)
      : Command(map->add_subcommand(
            "localizability",
            "Predict the position uncertainty by matching scans to the relief of a map")) {
    app()->add_option("MAP", map_, "folder of the map")->type_name("FOLDER")->required();
    app()
        ->add_option(
            "--step", step_m_,
            "spacing of the evaluated positions [m]; default: 120 positions along the longer side")
        ->check(CLI::Range(0.5, 1e5));
    app()
        ->add_option("--radius", params_.radius_m, "radius of the ground that a scan covers [m]")
        ->check(CLI::Range(5.0, 200.0))
        ->capture_default_str();
    CLI::Option* const path =
        app()
            ->add_option("--path", path_,
                         "also predict the uncertainty along this path without GPS: CSV with "
                         "columns x_m and y_m, east and north in the frame of the map")
            ->check(CLI::ExistingFile);
    app()
        ->add_option("--start-sigma", motion_.start_sigma_m,
                     "sigma of the position at the start of the path, per axis [m]")
        ->check(CLI::Range(0.001, 1000.0))
        ->capture_default_str()
        ->needs(path);
    app()
        ->add_option("--drift", motion_.drift,
                     "sigma of the dead reckoning as a share of the distance driven")
        ->check(CLI::Range(1e-6, 1.0))
        ->capture_default_str()
        ->needs(path);
    app()
        ->add_option("-o,--out", out_,
                     "folder for localizability.svg and .json, and path.svg with --path")
        ->type_name("FOLDER");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "The sigma at a position is that of one scan matched to the map, in its worst direction:\n"
        "a plane contains no information, a valley none along its axis. Along a path the matches\n"
        "are fused with dead reckoning, one match per radius of distance. The systematic error of\n"
        "the survey is not included.\n"
        "Example:\n"
        "  rcs map localizability maps/valley --path route.csv -o out/where");
  }

  int run() override {
    const Outcome done = compute();
    return done ? kExitOk : fail(kMapLocalizabilityName, done.error());
  }

 private:
  Outcome compute() {
    const Result<MapFolder> folder = MapFolder::open(map_);
    if (!folder) return folder.error();
    Result<std::vector<Vec2>> path = read_path();
    if (!path) return path.error();
    const Result<ElevationMap> map = ElevationMap::load(map_, kMapMemory_bytes);
    if (!map) return map.error();
    const Extent extent = known_part(*map, extent_of(folder->index()));
    if (extent.low_m.x() > extent.high_m.x()) return Error{map_ + ": no known cells"};
    if (Outcome sampled = sample(*map, extent); !sampled) return sampled;
    if (!path->empty()) along_ = path_uncertainty_along(*map, *path, motion_, params_);
    return print(*path);
  }

  [[nodiscard]] Result<std::vector<Vec2>> read_path() const {
    if (path_.empty()) return std::vector<Vec2>();
    Result<std::vector<Vec2>> path = tools::load_places(path_);
    if (path && path->size() < 2) return Error{path_ + ": expected two or more places"};
    return path;
  }

  Outcome sample(const ElevationMap& map, const Extent& extent) {
    const Vec2 wide_m = extent.high_m - extent.low_m;
    if (step_m_ <= 0.0) step_m_ = std::max(1.0, std::ceil(wide_m.maxCoeff() / kPlaces));
    const Vec2 low = (extent.low_m / step_m_).array().floor();
    const Vec2 high = (extent.high_m / step_m_).array().floor();
    const Vec2 count = high - low + Vec2::Ones();
    if (count.prod() > kMaxPlaces) {
      return Error{fmt::format("--step {} m: {:.0f} x {:.0f} positions, at most {:.0f} in all",
                               step_m_, count.x(), count.y(), kMaxPlaces)};
    }
    const InterruptGuard interrupt;
    Progress progress(kMapLocalizabilityName, static_cast<std::int64_t>(count.y()));
    for (int j = static_cast<int>(low.y()); j <= static_cast<int>(high.y()); ++j) {
      if (interrupt.requested()) return Error{"interrupted"};
      progress.at(j - static_cast<std::int64_t>(low.y()));
      for (int i = static_cast<int>(low.x()); i <= static_cast<int>(high.x()); ++i) {
        const Vec2 place = step_m_ * Vec2(i + 0.5, j + 0.5);
        Elevation known;
        if (!map.sample(place.x(), place.y(), &known)) continue;
        places_.push_back({i, j, worst_sigma_m(terrain_information(map, place, params_))});
      }
    }
    if (places_.empty()) return Error{map_ + ": no known cell at any of the positions"};
    return Done{};
  }

  /// Share of the known positions with a sigma of at most `limit_m`.
  [[nodiscard]] double share_within(double limit_m) const {
    const auto within = std::count_if(places_.begin(), places_.end(),
                                      [&](const Place& p) { return p.sigma_m <= limit_m; });
    return static_cast<double>(within) / static_cast<double>(places_.size());
  }

  [[nodiscard]] Json json() const {
    Json shares = Json::array();
    for (const double limit_m : kLimits_m) {
      shares.push_back({{"sigma_m", limit_m}, {"share", share_within(limit_m)}});
    }
    Json out = {{"map", map_},
                {"step_m", step_m_},
                {"radius_m", params_.radius_m},
                {"places", places_.size()},
                {"share_within", std::move(shares)}};
    if (along_.empty()) return out;
    Json path = Json::array();
    for (const PathUncertainty& s : along_) {
      path.push_back({{"travelled_m", s.travelled_m},
                      {"x_m", s.place_m.x()},
                      {"y_m", s.place_m.y()},
                      {"sigma_dead_reckoning_m", s.sigma_dead_reckoning_m},
                      {"sigma_with_map_m", s.sigma_with_map_m}});
    }
    out["path"] = std::move(path);
    return out;
  }

  [[nodiscard]] std::string text() const {
    report::Table shares{{"sigma of a scan, worst direction"}, {{"share of known ground [%]"}}};
    for (const double limit_m : kLimits_m) {
      shares.header.push_back(fmt::format("<= {:g} m", limit_m));
      shares.rows[0].push_back(fmt::format("{:.1f}", 100.0 * share_within(limit_m)));
    }
    std::string out =
        fmt::format("{} positions, {:g} m apart\n{}", places_.size(), step_m_, to_text(shares));
    if (along_.empty()) return out;
    constexpr std::size_t kRows = 20;
    report::Table path{
        {"distance [m]", "east [m]", "north [m]", "sigma, dead reckoning [m]", "with map [m]"}, {}};
    const std::size_t every = (along_.size() + kRows - 1) / kRows;
    for (std::size_t k = 0; k < along_.size(); ++k) {
      if (k % every != 0 && k + 1 != along_.size()) continue;
      const PathUncertainty& s = along_[k];
      path.rows.push_back(
          {fmt::format("{:.0f}", s.travelled_m), fmt::format("{:.0f}", s.place_m.x()),
           fmt::format("{:.0f}", s.place_m.y()), fmt::format("{:.2f}", s.sigma_dead_reckoning_m),
           fmt::format("{:.2f}", s.sigma_with_map_m)});
    }
    return out + to_text(path);
  }

  [[nodiscard]] report::Plot picture(const std::vector<Vec2>& course) const {
    report::Plot plot = report::view_from_above(
        "Sigma of one scan matched to the map, worst direction (10 m and above as 10 m)", true,
        760);
    plot.map = report::CellMap{step_m_, {}, "sigma [m]", true};
    for (const Place& p : places_) {
      plot.map->cells.push_back({p.i, p.j, std::min(p.sigma_m, kCoarsest_m)});
    }
    report::Series path{"path", report::Colour::kOrange, report::SeriesStyle::kThickLine, {}, {},
                        {}};
    for (const Vec2& p : course) {
      path.x.push_back(p.x());
      path.y.push_back(p.y());
    }
    if (!course.empty()) plot.series.push_back(std::move(path));
    return plot;
  }

  [[nodiscard]] report::Plot path_plot() const {
    report::Plot plot;
    plot.title = "Predicted uncertainty along the path without GPS";
    plot.x_label = "distance [m]";
    plot.y_label = "sigma, worst direction [m]";
    plot.y_from_zero = true;
    report::Series dead{
        "dead reckoning", report::Colour::kGrey, report::SeriesStyle::kDashed, {}, {}, {}};
    report::Series with_map{
        "with map", report::Colour::kBlue, report::SeriesStyle::kThickLine, {}, {}, {}};
    for (const PathUncertainty& s : along_) {
      dead.x.push_back(s.travelled_m);
      dead.y.push_back(s.sigma_dead_reckoning_m);
      with_map.x.push_back(s.travelled_m);
      with_map.y.push_back(s.sigma_with_map_m);
    }
    plot.series = {std::move(dead), std::move(with_map)};
    return plot;
  }

  [[nodiscard]] Outcome print(const std::vector<Vec2>& course) const {
    const std::string as_json = report::json_document(kMapLocalizabilityName, json());
    Outcome written = Done{};
    if (!out_.empty()) {
      written = tools::write_text(out_ + "/localizability.json", as_json);
      if (written) {
        written =
            tools::write_text(out_ + "/localizability.svg", report::render(picture(course), true));
      }
      if (written && !along_.empty()) {
        written = tools::write_text(out_ + "/path.svg", report::render(path_plot(), true));
      }
    }
    if (written) fmt::print("{}", json_ ? as_json : text());
    return written;
  }

  std::string map_;
  double step_m_ = 0.0;
  LocalizabilityParams params_;
  std::string path_;
  DeadReckoning motion_;
  std::string out_;
  bool json_ = false;
  std::vector<Place> places_;  // by j, then i
  std::vector<PathUncertainty> along_;
};

}  // namespace

void add_map_localizability_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapLocalizability>(map));
}

}  // namespace rcs::cli
