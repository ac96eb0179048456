// rcs map worth

#include <fmt/format.h>

#include <algorithm>

#include "tools/base/files.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/studies/map_study.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kName = "map worth";

class MapWorth final : public Command {
 public:
  explicit MapWorth(CLI::App* map)
      : Command(map->add_subcommand(
            "worth", "How far off is a vehicle without GPS, by the resolution of its map?")) {
    app()
        ->add_option("SCENARIO", scenarios_, "simulated drives (config/sim/*.toml)")
        ->check(CLI::ExistingFile)
        ->required();
    app()
        ->add_option("--cell", cells_m_, "of the maps [m]; each drive also goes without a map")
        ->check(CLI::Range(0.2, 100.0))
        ->delimiter(',')
        ->capture_default_str();
    app()
        ->add_option("--ins", plan_.ins, "grade of the INS, of the simulator and of WM")
        ->check(CLI::IsMember({"tactical", "industrial", "consumer"}));
    app()
        ->add_option("--gps-lost-at", plan_.gps_lost_s, "[s], for good")
        ->check(CLI::Range(10.0, 1000.0))
        ->capture_default_str();
    app()
        ->add_option("--length", plan_.length_s, "of each drive [s]; 0: all of it")
        ->check(CLI::Range(0.0, 1e5))
        ->capture_default_str();
    app()->add_option("--config", config_, "the vehicle's configuration")->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "drives with each map")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app()
        ->add_option("--first-seed", first_seed_, "of the noise and, where it follows, the terrain")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app()
        ->add_option("--jobs", jobs_, "drives at a time; default: one a core")
        ->check(CLI::Range(1, 256));
    app()->add_option("-o,--out", out_, "folder for worth.json and worth.svg");
    app()->add_flag("--json", json_, "the figures as JSON on stdout");
    app()->footer(
        "GPS is lost for good soon after the start; from then on the position's error against the\n"
        "truth, on three axes, is taken once a second. A map is the mean of the bare ground over\n"
        "its cells with the errors that the scenario's [prior_map] states. \"RMS to no map\" above "
        "1:\n"
        "the map does harm (0.2 m without a map at least). Inside: truths within the 95 % "
        "ellipsoid\n"
        "that WM claims.\n"
        "Example:\n"
        "  rcs map worth config/sim/drill_long.toml --cell 0.5,5,30 --seeds 3 -o out/worth");
  }

  int run() override {
    const Outcome done = run_all();
    return done ? kExitOk : fail(kName, done.error());
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
      blocks_[drill].runs[run] = studies::map_worth_run(plan_, record);
    };
    const Result<std::vector<drills::DrillResult>> results =
        run_campaign_at_terminal(kName, out_, jobs_, std::move(campaign));
    if (!results) return results.error();
    for (std::size_t k = 0; k < results->size(); ++k) blocks_[k].error = (*results)[k].error;
    return tell();
  }

  [[nodiscard]] Outcome tell() const {
    const std::string json = studies::map_worth_json(blocks_).dump(2) + "\n";
    fmt::print("{}", json_ ? json : to_text(studies::map_worth_table(blocks_)));
    if (!out_.empty()) {
      Outcome written = tools::write_text(out_ + "/worth.json", json);
      if (written)
        written = tools::write_text(out_ + "/worth.svg", studies::map_worth_svg(blocks_));
      if (!written) return written;
    }
    for (const studies::MapWorthBlock& block : blocks_) {
      if (!block.error.empty()) return Error{block.scenario + ": " + block.error};
    }
    return Done{};
  }

  std::vector<std::string> scenarios_;
  std::vector<double> cells_m_ = {0.5, 5.0, 30.0};
  std::string config_ = "config/demo3.toml";
  studies::MapWorthPlan plan_;
  int seeds_ = 3;
  std::int64_t first_seed_ = 1001;
  int jobs_ = 0;
  std::string out_;
  bool json_ = false;
  std::vector<studies::MapWorthBlock> blocks_;
};

}  // namespace

void add_map_worth_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapWorth>(map));
}

}  // namespace rcs::cli
