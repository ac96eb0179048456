// rcs consistency

#include <fmt/format.h>

#include <algorithm>

#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/page_origin.h"
#include "tools/report/json_document.h"
#include "tools/studies/consistency_output.h"
#include "tools/studies/consistency_page.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kConsistencyName = "consistency";

class ConsistencyCommand final : public Command {
 public:
  explicit ConsistencyCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand("consistency",
                                    "Compare the errors of WM with its covariances over many "
                                    "simulated drives")) {
    add_repeated(app(), "--scenario", &scenarios_, "scenario of the drives")
        ->transform(command_line::config_file())
        ->capture_default_str();
    add_list(app(), "--ins", &grades_, "INS grades, of both the simulator and WM")
        ->check(CLI::IsMember({"tactical", "industrial", "consumer"}))
        ->capture_default_str();
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->type_name("FILE")
        ->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "drives for each scenario and grade")
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
    app()
        ->add_option("-o,--out", out_, "folder for consistency.json and consistency.html")
        ->type_name("FOLDER");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "Each drive is simulated and processed by SP and WM in lockstep; GPS is cut at 35 s. The\n"
        "errors of position, velocity and attitude against the truth are normalized by the\n"
        "published covariances, at 30 s (with GPS) and 10, 30 and 60 s into the outage. NEES and\n"
        "NIS per degree of freedom are 1 for a consistent filter and above 1 for an overconfident\n"
        "one.\n" +
        studies::limits_text() +
        "\n"
        "With fewer than 20 drives a limit fails only if its violation is statistically "
        "significant.\n"
        "Exit status 1 if a limit is violated.\n"
        "Examples:\n"
        "  rcs consistency -o out/consistency                       # 270 drives, about 25 "
        "minutes\n"
        "  rcs consistency --seeds 5 --ins consumer --scenario config/sim/meadow.toml\n"
        "  rcs consistency --seeds 20 --first-seed 5001 --config config/my_vehicle.toml --json");
  }

  int run() override {
    for (std::string& scenario : scenarios_) scenario = command_line::find_config(scenario);
    config_ = command_line::find_config(config_);
    const Outcome done = run_all();
    if (!done) return fail(kConsistencyName, done.error());
    const auto failed = [](const studies::ConsistencyBlock& block) { return !block.error.empty(); };
    if (std::any_of(report_.blocks.begin(), report_.blocks.end(), failed)) return kExitInput;
    return report_.passed() ? kExitOk : kExitNegative;
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
        run_campaign_at_terminal(kConsistencyName, out_, jobs_, std::move(campaign));
    if (!results) return results.error();
    for (std::size_t k = 0; k < results->size(); ++k) report_.blocks[k].error = (*results)[k].error;
    return print_results();
  }

  [[nodiscard]] Outcome print_results() const {
    const std::string json = report::json_document(kConsistencyName, to_json(report_));
    if (json_) {
      fmt::print("{}", json);
    } else {
      fmt::print("{}\n{}\n{}\n{}\n{}\n", to_text(studies::nees_table(report_)),
                 to_text(studies::nis_table(report_)), to_text(studies::error_table(report_)),
                 to_text(studies::protection_table(report_)), studies::limits_text());
    }
    for (const studies::ConsistencyBlock& block : report_.blocks) {
      if (block.error.empty()) continue;
      fmt::print(stderr, "rcs consistency: {}, {}: {}\n", block.scenario, block.ins, block.error);
    }
    if (out_.empty()) return Done{};
    Outcome written = tools::write_text(out_ + "/consistency.json", json);
    if (written) {
      written = tools::write_text(out_ + "/consistency.html",
                                  studies::consistency_page(report_, page_origin(config_)));
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
