// rcs map study

#include <fmt/format.h>

#include <algorithm>

#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/report/json_document.h"
#include "tools/studies/map_study.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kMapStudyName = "map study";

class MapStudy final : public Command {
 public:
  explicit MapStudy(CLI::App* map)
      : Command(map->add_subcommand(
            "study", "Measure the position error without GPS as a function of map resolution")) {
    app()
        ->add_option("SCENARIO", scenarios_, "simulated drives (config/sim/*.toml)")
        ->transform(command_line::config_file())
        ->required();
    add_list(app(), "--cell", &cells_m_,
             "cell sizes of the maps [m]; each drive is also run without a map")
        ->check(CLI::Range(0.2, 100.0))
        ->capture_default_str();
    app()
        ->add_option("--ins", plan_.ins, "INS grade, of both the simulator and WM")
        ->check(CLI::IsMember({"tactical", "industrial", "consumer"}));
    app()
        ->add_option("--gps-lost-at", plan_.gps_lost_s, "time of the permanent loss of GPS [s]")
        ->check(CLI::Range(10.0, 1000.0))
        ->capture_default_str();
    app()
        ->add_option("--length", plan_.length_s, "length of each drive [s]; 0: the whole drive")
        ->check(CLI::Range(0.0, 1e5))
        ->capture_default_str();
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->type_name("FILE")
        ->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "drives with each map")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app()
        ->add_option("--first-seed", first_seed_,
                     "first seed of the noise and, unless the scenario fixes it, of the terrain")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app()
        ->add_option("--jobs", jobs_, "parallel drives; default: one per core")
        ->check(CLI::Range(1, 256));
    app()->add_option("-o,--out", out_, "folder for study.json and study.svg")->type_name("FOLDER");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "GPS is lost permanently soon after the start; from then on the error of the position, on\n"
        "three axes, is sampled once per second. A map is the mean of the bare ground over its\n"
        "cells with the errors in [prior_map] of the scenario. \"RMS to no map\" is the RMS error\n"
        "divided by that without a map (at least 0.2 m); above 1 the map is harmful. Inside: "
        "share\n"
        "of the true positions within the 95 % ellipsoid of WM.\n"
        "Example:\n"
        "  rcs map study config/sim/drill_long.toml --cell 0.5,5,30 --seeds 3 -o out/study");
  }

  int run() override {
    config_ = command_line::find_config(config_);
    const Outcome done = run_all();
    return done ? kExitOk : fail(kMapStudyName, done.error());
  }

 private:
  Outcome run_all() {
    Result<drills::DrillVehicle> vehicle = drills::load_drill_vehicle(config_);
    if (!vehicle) return vehicle.error();
    std::sort(cells_m_.begin(), cells_m_.end());
    drills::DrillCampaign campaign;
    campaign.vehicle = std::move(vehicle).value();
    campaign.seeds = seeds_;
    campaign.first_seed = first_seed_;
    const auto add = [&](const std::string& scenario, std::optional<double> cell_m) {
      campaign.drills.push_back(plan_.drill(scenario, cell_m));
      blocks_.push_back({scenario, cell_m, {}, {}});
      blocks_.back().runs.resize(static_cast<std::size_t>(seeds_));
    };
    for (const std::string& scenario : scenarios_) {
      add(scenario, std::nullopt);
      for (const double cell_m : cells_m_) add(scenario, cell_m);
    }
    campaign.look = [this](std::size_t drill, std::size_t run, const drills::DrillRecord& record) {
      blocks_[drill].runs[run] = studies::map_study_run(plan_, record);
    };
    const Result<std::vector<drills::DrillResult>> results =
        run_campaign_at_terminal(kMapStudyName, out_, jobs_, std::move(campaign));
    if (!results) return results.error();
    for (std::size_t k = 0; k < results->size(); ++k) blocks_[k].error = (*results)[k].error;
    return print_results();
  }

  [[nodiscard]] Outcome print_results() const {
    const std::string json = report::json_document(kMapStudyName, studies::map_study_json(blocks_));
    fmt::print("{}", json_ ? json : to_text(studies::map_study_table(blocks_)));
    if (!out_.empty()) {
      Outcome written = tools::write_text(out_ + "/study.json", json);
      if (written)
        written = tools::write_text(out_ + "/study.svg", studies::map_study_svg(blocks_));
      if (!written) return written;
    }
    for (const studies::MapStudyBlock& block : blocks_) {
      if (!block.error.empty()) return Error{block.scenario + ": " + block.error};
    }
    return Done{};
  }

  std::vector<std::string> scenarios_;
  std::vector<double> cells_m_ = {0.5, 5.0, 30.0};
  std::string config_ = "config/demo3.toml";
  studies::MapStudyPlan plan_;
  int seeds_ = 3;
  std::int64_t first_seed_ = 1001;
  int jobs_ = 0;
  std::string out_;
  bool json_ = false;
  std::vector<studies::MapStudyBlock> blocks_;
};

}  // namespace

void add_map_study_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapStudy>(map));
}

}  // namespace rcs::cli
