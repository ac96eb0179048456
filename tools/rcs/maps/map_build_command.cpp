// rcs map build

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <limits>

#include "modules/sp/sp_config.h"
#include "rcs/command_line/config_files.h"
#include "tools/mapping/map_build.h"
#include "tools/mapping/merge.h"
#include "tools/mapping/survey_date.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

using report::Json;

constexpr std::string_view kMapBuildName = "map build";

/// Intermediate maps: next to the output, with the process id in their names, removed at the end.
class PartMaps {
 public:
  explicit PartMaps(std::string out) : out_(std::move(out)) {
    while (out_.size() > 1 && out_.back() == '/') out_.pop_back();
  }
  PartMaps(const PartMaps&) = delete;
  PartMaps& operator=(const PartMaps&) = delete;
  ~PartMaps() {
    std::error_code ignored;
    for (const std::string& path : paths_) std::filesystem::remove_all(path, ignored);
  }
  const std::string& next() {
    paths_.push_back(fmt::format("{}.{}.part{}", out_, ::getpid(), paths_.size()));
    return paths_.back();
  }
  [[nodiscard]] const std::vector<std::string>& paths() const { return paths_; }

 private:
  std::string out_;
  std::vector<std::string> paths_;
};

class MapBuildCommand final : public Command {
 public:
  explicit MapBuildCommand(CLI::App* map)
      : Command(map->add_subcommand(
            "build", "Build a map of the bare ground from recorded scans and poses")) {
    add_inputs();
    add_what_is_wanted();
    app()->footer(
        "The points are SP_POINTS of the runs (deskewed and thinned by SP) or, with --config, the\n"
        "data of the LADAR. A log of `rcs replay` lacks the latter: name the log of the sensors "
        "by\n"
        "--sensors. The ground is the lowest mode of the returns of a cell. Permeable grass, tree\n"
        "crowns, moving objects, rocks and walls are removed, and so are cells with impermeable\n"
        "vegetation. The misalignment and the clock error of the LADAR are estimated from the\n"
        "ground. The error of the poses becomes the systematic error of the map. Several runs are\n"
        "independent surveys, merged as by `rcs map merge`.\n"
        "Examples:\n"
        "  rcs map build result.log -o maps/drive --date 2024-05-04\n"
        "  rcs map build result.log --sensors run.log --config config/my_vehicle.toml -o "
        "maps/drive\n"
        "  rcs map build monday.log tuesday.log --prior maps/valley -o maps/fine\n"
        "  rcs map build result.log --poses surveyed.tum --pose-sigma 0.02 -o maps/drive");
  }

  int run() override {
    if (const Outcome sound = check(); !sound) return wrong_usage(kMapBuildName, sound.error());
    Outcome done = read_config();
    if (done) done = build();
    return done ? print_results() : fail(kMapBuildName, done.error());
  }

 private:
  void add_inputs() {
    constexpr int kMaxRuns = 100;
    app()
        ->add_option("RUN", runs_,
                     "logs with WM_NAV_STATE and SP_POINTS: of live runs or of `rcs replay`")
        ->required()
        ->expected(1, kMaxRuns)
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--config", config_,
                     "the vehicle's configuration (TOML): use LADAR_RANGES and LADAR_POINTS")
        ->transform(command_line::config_file());
    CLI::Option* sensors =
        add_repeated(app(), "--sensors", &sensors_,
                     "log with the data of the LADAR, one for each RUN; default: the runs")
            ->check(CLI::ExistingFile);
    sensors->needs("--config");
    CLI::Option* poses =
        add_repeated(app(), "--poses", &pose_files_,
                     "poses in frame world instead of those of WM, one file for each RUN (TUM: t "
                     "tx ty tz qx qy qz qw)")
            ->check(CLI::ExistingFile);
    app()
        ->add_option(
            "--pose-sigma", pose_sigma_m_,
            "sigma of the heights of the poses [m]; default: from the covariances of WM; with "
            "--poses, from the file .sigma.csv of rcs smooth")
        ->check(CLI::Range(0.0, 1000.0));
    app()
        ->add_option("--pose-length", wanted_.pose_length_m,
                     "correlation length of the error of the poses [m]")
        ->check(CLI::Range(1.0, 1e7))
        ->capture_default_str();
    app()->add_flag("--truth", truth_, "use the exact poses of SIM_TRUTH")->excludes(poses);
  }

  void add_what_is_wanted() {
    app()
        ->add_option("-o,--out", out_, "folder of the map; an existing map is replaced")
        ->type_name("FOLDER")
        ->required();
    app()
        ->add_option("--cell", wanted_.ground.cell_m, "cell size of the map [m]")
        ->check(CLI::Range(0.05, 5.0))
        ->capture_default_str();
    app()
        ->add_option("--max-range", wanted_.max_range_m, "maximum range of the returns [m]")
        ->check(CLI::Range(2.0, 300.0))
        ->capture_default_str();
    app()->add_flag("--keep-mount", keep_mount_,
                    "do not estimate misalignment and clock error of the LADAR");
    app()->add_flag("--points", wanted_.points,
                    "also store surface points of static above-ground structure (trunks, walls), "
                    "to which scans are matched, too; only for one RUN");
    app()
        ->add_option("--prior", prior_,
                     "a map that fills the cells of the new tiles where no ground was observed")
        ->type_name("FOLDER");
    app()
        ->add_option("--date", date_,
                     "date of the runs: YYYY-MM-DD, from 2000 on; default: unknown")
        ->type_name("DATE");
    app()
        ->add_option("--memory", memory_mb_, "memory limit [MB]")
        ->check(CLI::Range(10.0, 1e6))
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
  }

  [[nodiscard]] Outcome check() {
    const auto one_each = [this](const std::vector<std::string>& files, const char* option) {
      return files.empty() || files.size() == runs_.size()
                 ? std::string()
                 : fmt::format("{}: {} files for {} runs; expected one for each", option,
                               files.size(), runs_.size());
    };
    for (const std::string& wrong :
         {one_each(sensors_, "--sensors"), one_each(pose_files_, "--poses")}) {
      if (!wrong.empty()) return Error{wrong};
    }
    for (const std::string& file : pose_files_) {
      if (!std::isnan(pose_sigma_m_) || std::filesystem::exists(recording::sigma_file_of(file))) {
        continue;
      }
      return Error{fmt::format("--poses: {}: {} not found: --pose-sigma is required", file,
                               recording::sigma_file_of(file))};
    }
    if (wanted_.points && runs_.size() > 1) {
      return Error{"--points: only for one RUN; merged surveys keep only the ground"};
    }
    if (!date_.empty()) {
      const int date = mapping::parse_date(date_);
      if (date == 0) return Error{"--date: " + date_ + ": expected YYYY-MM-DD from 2000 on"};
      wanted_.date = static_cast<std::uint16_t>(date);
    }
    if (truth_) wanted_.source = recording::PoseSource::kTruth;
    if (!pose_files_.empty()) wanted_.source = recording::PoseSource::kFile;
    if (!std::isnan(pose_sigma_m_)) wanted_.pose_sigma_m = pose_sigma_m_;
    wanted_.estimate_mount = !keep_mount_;
    wanted_.memory_bytes = memory_mb_ * 1e6;
    return Done{};
  }

  [[nodiscard]] Outcome read_config() {
    if (config_.empty()) return Done{};
    const Result<ParamFile> file = ParamFile::load(config_);
    if (!file) return file.error();
    const Result<sp::SpConfig> config = sp::load_sp_config(*file);
    if (!config) return config.error();
    wanted_.ladar = config->ladar;
    wanted_.reference = config->prior_terrain.reference_frame;
    return Done{};
  }

  [[nodiscard]] Outcome build() {
    const InterruptGuard interrupt;
    Progress progress(kMapBuildName, Progress::kSteps);
    const bool several = runs_.size() > 1;
    const double steps =
        static_cast<double>(runs_.size()) + (several ? 1.0 : 0.0) + (prior_.empty() ? 0.0 : 1.0);
    double done = 0.0;
    const auto going = [&](double share) {
      progress.at(static_cast<std::int64_t>(Progress::kSteps * (done + share) / steps));
      return !interrupt.requested();
    };
    PartMaps parts(out_);
    std::optional<MapFrame> frame;
    for (std::size_t k = 0; k < runs_.size(); ++k, done += 1.0) {
      wanted_.log = runs_[k];
      wanted_.sensors = sensors_.empty() ? runs_[k] : sensors_[k];
      if (!pose_files_.empty()) wanted_.pose_file = pose_files_[k];
      Result<mapping::MapBuilt> built = mapping::build_map(
          wanted_, frame, several || !prior_.empty() ? parts.next() : out_, going);
      if (!built) return built.error();
      frame = built->frame;
      built_.push_back(std::move(built).value());
    }
    std::string whole = several ? std::string() : out_;
    if (!parts.paths().empty()) whole = parts.paths().front();
    if (several) {
      const std::vector<std::string> runs = parts.paths();
      whole = prior_.empty() ? out_ : parts.next();
      const Result<mapping::Merged> merged = mapping::merge_maps(runs, whole, going);
      if (!merged) return merged.error();
      merged_ = *merged;
      done += 1.0;
    }
    if (prior_.empty()) return Done{};
    const Result<mapping::Filled> filled = mapping::fill_map(whole, prior_, out_, going);
    if (!filled) return filled.error();
    filled_ = *filled;
    return Done{};
  }

  [[nodiscard]] static Json json_of(const mapping::MapBuilt& b) {
    const mapping::GroundMetrics& g = b.ground;
    const Vec3& turn = b.mount.turn_vehicle;
    return {{"scans", b.scans.scans},
            {"scans_without_pose", b.scans.no_pose},
            {"points", b.scans.points},
            {"rejected_messages_or_points", b.scans.bad},
            {"damage", b.scans.damage},
            {"cells", g.cells},
            {"cells_observed_5_times", g.observed_5},
            {"roughness_median_m", g.roughness_median_m},
            {"sigma_median_m", g.sigma_median_m},
            {"bias_sigma_m", b.bias_sigma_m},
            {"returns",
             {{"ground", g.ground},
              {"above_ground", g.above_ground},
              {"transient", g.transient},
              {"without_ground", g.without_ground}}},
            {"cells_vegetated", g.vegetated},
            {"surface_points", b.points},
            {"cells_rejected_as_seen_through", b.seen_through},
            {"ladar_misalignment_deg", {degrees(turn.x()), degrees(turn.y()), degrees(turn.z())}},
            {"ladar_stamps_early_ms", 1e3 * -b.mount.late_s}};
  }

  int print_results() const {
    Json runs = Json::array();
    for (std::size_t k = 0; k < built_.size(); ++k) {
      Json run = {{"log", runs_[k]}};
      run.update(json_of(built_[k]));
      runs.push_back(std::move(run));
    }
    const std::int64_t cells = filled_   ? filled_->cells
                               : merged_ ? merged_->cells
                                         : built_.front().ground.cells;
    if (json_) {
      Json json = {{"cell_m", wanted_.ground.cell_m}, {"cells", cells}};
      if (filled_) json["cells_of_prior"] = filled_->filled;
      if (merged_) json["cells_of_several_runs"] = merged_->several;
      if (merged_) json["cells_that_contradict"] = merged_->changed;
      json["runs"] = std::move(runs);
      fmt::print("{}", report::json_document(kMapBuildName, json));
      return kExitOk;
    }
    report::Table table{{"run", "scans", "cells", "seen >= 5", "roughness [m]", "sigma [m]",
                         "systematic error [m]", "ground [%]", "above ground [%]", "transient [%]"},
                        {}};
    for (const Json& run : runs) {
      const Json& returns = run["returns"];
      double all = 1e-9;
      for (const auto& [name, number] : returns.items()) all += number.get<double>();
      const auto percent = [&](const char* name) {
        return fmt::format("{:.1f}", 100.0 * returns[name].get<double>() / all);
      };
      table.rows.push_back({run["log"].get<std::string>(), run["scans"].dump(), run["cells"].dump(),
                            run["cells_observed_5_times"].dump(),
                            fmt::format("{:.3f}", run["roughness_median_m"].get<double>()),
                            fmt::format("{:.3f}", run["sigma_median_m"].get<double>()),
                            fmt::format("{:.3f}", run["bias_sigma_m"].get<double>()),
                            percent("ground"), percent("above_ground"), percent("transient")});
      const std::string damage = run["damage"].get<std::string>();
      if (!damage.empty()) {
        fmt::print(stderr, "rcs {}: {}: {}\n", kMapBuildName, run["log"].get<std::string>(),
                   damage);
      }
    }
    table.note =
        "seen >= 5: cells with five or more returns of the ground; roughness, sigma: medians over "
        "the cells; ground, above ground, transient: shares of the returns";
    fmt::print("{}{}: {} cells of {:g} m{}{}\n", to_text(table), out_, cells, wanted_.ground.cell_m,
               filled_ ? fmt::format(", {} of them from {}", filled_->filled, prior_) : "",
               wanted_.points ? fmt::format(", {} surface points", built_.front().points) : "");
    return kExitOk;
  }

  std::vector<std::string> runs_;
  std::vector<std::string> sensors_;
  std::vector<std::string> pose_files_;
  std::string config_;
  std::string prior_;
  std::string out_;
  std::string date_;
  double pose_sigma_m_ = std::numeric_limits<double>::quiet_NaN();
  double memory_mb_ = 4000.0;
  bool truth_ = false;
  bool keep_mount_ = false;
  bool json_ = false;
  mapping::MapBuild wanted_;
  std::vector<mapping::MapBuilt> built_;
  std::optional<mapping::Merged> merged_;
  std::optional<mapping::Filled> filled_;
};

}  // namespace

void add_map_build_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapBuildCommand>(map));
}

}  // namespace rcs::cli
