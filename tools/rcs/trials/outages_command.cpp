// rcs outages

#include <fmt/format.h>

#include "rcs/command_line/config_files.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/report/json_document.h"
#include "tools/studies/outages.h"
#include "tools/studies/outages_output.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kOutagesName = "outages";

class OutagesCommand final : public Command {
 public:
  explicit OutagesCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "outages", "Measure the position error after GPS outages on a recorded drive")) {
    app()->add_option("LOG", log_, "a recorded drive")->required()->check(CLI::ExistingFile);
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->required()
        ->transform(command_line::config_file());
    CLI::Option* length =
        add_list(app(), "--length", &question_.lengths_s, "lengths of the outages [s]")
            ->capture_default_str()
            ->check(CLI::Range(0.5, 1e4));
    CLI::Option* places =
        app()
            ->add_option("--places", question_.places,
                         "number of outages of each length, distributed over the log")
            ->capture_default_str()
            ->check(CLI::Range(1, 1000));
    app()
        ->add_option(
            "--from", question_.from_s,
            "earliest begin of an outage after the first message [s]: WM must be initialized\n"
            "by then; errors before this time are not counted")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1e5));
    add_numbers(app(), "--cut", &cut_s_, "FROM,TO", 0.0, 1e5,
                "a single outage from FROM to TO [s]; the run continues to the end of the log")
        ->excludes(length)
        ->excludes(places);
    add_list(app(), "--without", &without_,
             "repeat all outages without odometry, ladar or ins in the whole run; names\n"
             "joined by + are excluded together")
        ->type_name("NAME");
    app()
        ->add_option("--jobs", jobs_, "parallel runs; default: one per core")
        ->check(CLI::Range(1, 256));
    app()
        ->add_option("--logs", logs_, "folder for a log of each run (rcs why)")
        ->type_name("FOLDER");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "SP and WM process the log in lockstep, once with GPS and once for each outage. Errors "
        "are\n"
        "horizontal, at the end of the outage, median/maximum over the outages of a length (for\n"
        "an even number the lower median). The reference is SIM_TRUTH; in a log without it, the\n"
        "output of WM with GPS in the whole run, and the first fix after the outage. For "
        "comparison\n"
        "dead reckoning from the belief of WM at the begin of the outage: gyro (bias corrected)\n"
        "with wheel speed; gyro with the initial speed; wheels alone; INS alone; registrations of\n"
        "SP in a run without GPS.\n"
        "Examples:\n"
        "  rcs outages run.log --config config/my_vehicle.toml\n"
        "  rcs outages comma.log --config config/comma2k19.toml --length 10,20,30 --places 10 \\\n"
        "      --without odometry\n"
        "  rcs outages husky.log --config config/husky.toml --cut 137,257 --json");
  }

  int run() override {
    if (!cut_s_.empty()) {
      if (cut_s_[1] <= cut_s_[0]) {
        fmt::print(stderr, "rcs outages: --cut {},{}: TO must be after FROM\n", cut_s_[0],
                   cut_s_[1]);
        return kExitUsage;
      }
      question_.cut = drills::DrillWindow{cut_s_[0], cut_s_[1]};
    }
    for (const std::string& text : without_) {
      Result<std::vector<drills::DrillSource>> sources = studies::parse_without(text);
      if (!sources) {
        fmt::print(stderr, "rcs outages: --without {}\n", sources.error().message);
        return kExitUsage;
      }
      question_.without.push_back(std::move(sources).value());
    }
    const Result<studies::OutageReport> report = answer();
    if (!report) return fail(kOutagesName, report.error());
    print_results(*report);
    return kExitOk;
  }

 private:
  Result<studies::OutageReport> answer() {
    Result<drills::DrillVehicle> vehicle = drills::load_drill_vehicle(config_);
    if (!vehicle) return vehicle.error();
    const Result<studies::RecordedMotion> motion = studies::read_motion(log_);
    if (!motion) return motion.error();
    if (!motion->damage.empty()) fmt::print(stderr, "rcs outages: {}: {}\n", log_, motion->damage);
    if (!motion->place) return Error{log_ + ": no valid GPS_FIX, hence no outage to simulate"};
    const double drive_s = seconds(motion->end - *motion->begin);
    const Result<std::vector<studies::OutagePlan>> plans =
        studies::plan_outages(question_, drive_s, motion->has_ladar);
    if (!plans) return Error{log_ + ": " + plans.error().message};
    drills::DrillCampaign campaign;
    for (const studies::OutagePlan& plan : *plans) campaign.drills.push_back(plan.drill);
    campaign.vehicle = std::move(vehicle).value();
    campaign.log = log_;
    campaign.logs_folder = logs_;
    const Result<std::vector<drills::DrillResult>> results =
        run_campaign_at_terminal(kOutagesName, logs_, jobs_, std::move(campaign));
    if (!results) return results.error();
    return studies::judge_outages(question_, *plans, *results, *motion);
  }

  void print_results(const studies::OutageReport& report) const {
    if (json_) {
      report::Json j = to_json(report);
      j["log"] = log_;
      j["config"] = config_;
      fmt::print("{}", report::json_document(kOutagesName, j));
    } else {
      fmt::print("reference of the errors: {}\n{}\n{}", report.reference,
                 to_text(outage_table(report)), to_text(dead_reckoning_table(report)));
      if (question_.cut) fmt::print("\n{}", to_text(studies::cut_table(report)));
      fmt::print("run with GPS: WM accepted GPS for {:.1f} % of the time after {:g} s\n",
                 100.0 * report.with_gps.accepted_share, question_.from_s);
    }
    for (const studies::OutageFinding& f : report.findings) {
      if (f.failed.empty()) continue;
      fmt::print(stderr, "rcs outages: {:.1f} to {:.1f} s, {}: not counted: {}\n", f.window.begin_s,
                 f.window.end_s, report.variants[f.variant], f.failed);
    }
  }

  std::string log_;
  std::string config_;
  studies::OutageQuestion question_;
  std::vector<double> cut_s_;
  std::vector<std::string> without_;
  int jobs_ = 0;
  std::string logs_;
  bool json_ = false;
};

}  // namespace

void add_outages_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<OutagesCommand>(rcs));
}

}  // namespace rcs::cli
