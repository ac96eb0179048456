// rcs consistency

#include <fmt/format.h>

#include "tools/base/files.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/studies/consistency_output.h"
#include "tools/studies/consistency_page.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kName = "consistency";

class ConsistencyCommand final : public Command {
 public:
  explicit ConsistencyCommand(CLI::App* rcs)
      : Command(
            rcs->add_subcommand("consistency", "Is what the filter says of its own error true?")) {
    app()
        ->add_option("--scenario", scenarios_, "the drives; again for more than one")
        ->check(CLI::ExistingFile)
        ->capture_default_str();
    app()
        ->add_option("--ins", grades_, "grades of the INS, of the simulator and of WM")
        ->check(CLI::IsMember({"tactical", "industrial", "consumer"}))
        ->delimiter(',')
        ->capture_default_str();
    app()->add_option("--config", config_, "the vehicle's configuration")->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "drives of each scenario and grade")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app()
        ->add_option("--first-seed", first_seed_, "of the noise and, where it follows, the terrain")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app()
        ->add_option("--jobs", jobs_, "drives at a time; default: one a core")
        ->check(CLI::Range(1, 256));
    app()->add_option("-o,--out", out_, "folder for consistency.json and consistency.html");
    app()->add_flag("--json", json_, "the figures as JSON on stdout");
    app()->footer(
        "Each drive is simulated and goes through SP and WM in lockstep; GPS is cut at 35 s. WM's\n"
        "position, velocity and attitude are held against the truth with the covariances that it\n"
        "published, at 30 s (with GPS) and 10, 30 and 60 s into the outage. NEES and NIS per "
        "degree\n"
        "of freedom are 1 when the filter tells the truth; above, it claims too much.\n" +
        studies::marks_text() +
        "\n"
        "With fewer than 20 drives only what chance does not explain fails.\n"
        "Exit status: 0 nothing misses its mark; 1 something does.\n"
        "Examples:\n"
        "  rcs consistency -o out/consistency                       # 270 drives, about 25 "
        "minutes\n"
        "  rcs consistency --seeds 5 --ins consumer --scenario config/sim/meadow.toml\n"
        "  rcs consistency --seeds 20 --first-seed 5001 --config config/my_vehicle.toml --json");
  }

  int run() override {
    const Outcome done = run_all();
    if (!done) return fail(kName, done.error());
    return report_.passed() ? kExitOk : kExitFailed;
  }

 private:
  Outcome run_all() {
    Result<drills::DrillVehicle> vehicle = drills::load_drill_vehicle(config_);
    if (!vehicle) return vehicle.error();
    drills::DrillCampaign campaign;
    campaign.vehicle = std::move(vehicle).value();
    campaign.seeds = seeds_;
    campaign.first_seed = first_seed_;
    for (const std::string& scenario : scenarios_) {
      for (const std::string& ins : grades_) {
        campaign.drills.push_back(report_.plan.drill(scenario, ins));
        report_.blocks.push_back({scenario, ins, {}, {}});
        report_.blocks.back().runs.resize(static_cast<std::size_t>(seeds_));
      }
    }
    campaign.look = [this](std::size_t drill, std::size_t run, const drills::DrillRecord& record) {
      const std::int64_t seed = first_seed_ + static_cast<std::int64_t>(run);
      report_.blocks[drill].runs[run] = studies::consistency_run(report_.plan, seed, record);
    };
    const Result<std::vector<drills::DrillResult>> results =
        run_campaign_at_terminal(kName, out_, jobs_, std::move(campaign));
    if (!results) return results.error();
    for (std::size_t k = 0; k < results->size(); ++k) report_.blocks[k].error = (*results)[k].error;
    return tell();
  }

  [[nodiscard]] Outcome tell() const {
    const std::string json = to_json(report_).dump(2) + "\n";
    if (json_) {
      fmt::print("{}", json);
    } else {
      fmt::print("{}\n{}\n{}\n{}\n{}\n", to_text(studies::nees_table(report_)),
                 to_text(studies::nis_table(report_)), to_text(studies::error_table(report_)),
                 to_text(studies::protection_table(report_)), studies::marks_text());
    }
    for (const studies::ConsistencyBlock& block : report_.blocks) {
      if (block.error.empty()) continue;
      fmt::print(stderr, "rcs consistency: {}, {}: {}\n", block.scenario, block.ins, block.error);
    }
    if (out_.empty()) return Done{};
    Outcome written = tools::write_text(out_ + "/consistency.json", json);
    if (written) {
      written = tools::write_text(out_ + "/consistency.html",
                                  studies::consistency_page(report_, config_));
    }
    return written;
  }

  std::vector<std::string> scenarios_ = {"config/sim/meadow.toml", "config/sim/rocky_hills.toml",
                                         "config/sim/wooded_valley.toml"};
  std::vector<std::string> grades_ = {"tactical", "industrial", "consumer"};
  std::string config_ = "config/demo3.toml";
  int seeds_ = 30;
  std::int64_t first_seed_ = 1001;
  int jobs_ = 0;
  std::string out_;
  bool json_ = false;
  studies::ConsistencyReport report_;
};

}  // namespace

void add_consistency_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<ConsistencyCommand>(rcs));
}

}  // namespace rcs::cli
