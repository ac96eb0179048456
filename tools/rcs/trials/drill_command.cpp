// rcs drill

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/drills/drill_output.h"
#include "tools/drills/drill_page.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kDrillName = "drill";

/// The drills of a folder and its sub-folders, sorted by file name.
Result<std::vector<std::string>> drills_in(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<fs::path> paths;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() == ".toml") paths.push_back(entry->path());
  }
  if (error) return Error{folder + ": " + error.message()};
  std::sort(paths.begin(), paths.end(), [](const fs::path& a, const fs::path& b) {
    return std::make_pair(a.filename(), a) < std::make_pair(b.filename(), b);
  });
  if (paths.empty()) return Error{folder + ": no drills (*.toml)"};
  return std::vector<std::string>(paths.begin(), paths.end());
}

class DrillCommand final : public Command {
 public:
  explicit DrillCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "drill", "Run fault-injection tests of the navigation and check their limits")) {
    app()
        ->add_option("DRILL", paths_, "stimuli and limits of a drill (TOML)")
        ->transform(command_line::config_file());
    app()->add_flag("--all", all_, "all drills of the folder except the long ones");
    app()->add_flag("--full", full_,
                    "all drills, each with its full number of seeds (seeds_full, default 20)");
    app()->add_flag("--list", list_, "list the drills of the folder");
    app()
        ->add_option("--folder", folder_, "folder of the drills for --all, --full and --list")
        ->type_name("FOLDER")
        ->capture_default_str();
    CLI::Option* scenario =
        app()
            ->add_option("--scenario", scenario_,
                         "simulated drive of the drills without a scenario of their own")
            ->type_name("FILE")
            ->capture_default_str();
    app()
        ->add_option("--log", log_,
                     "a recorded drive instead of the simulation. Without SIM_TRUTH in it, errors\n"
                     "are relative to the output of WM in the undisturbed run")
        ->check(CLI::ExistingFile)
        ->excludes(scenario);
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->type_name("FILE")
        ->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "number of runs of each drill; default: that of the drill")
        ->check(CLI::Range(1, 1000));
    app()
        ->add_option("--first-seed", first_seed_, "first seed of the noise; default: 1")
        ->check(CLI::NonNegativeNumber);
    app()
        ->add_option("--jobs", jobs_, "parallel runs; default: one per core")
        ->check(CLI::Range(1, 256));
    app()
        ->add_option("-o,--out", out_, "folder for results.json, junit.xml and report.html")
        ->type_name("FOLDER");
    app()->add_flag("--logs", logs_, "also write a log of the first run of each drill (rcs why)");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "A drill disturbs the sensor messages of a drive (GPS outages, false fixes, LADAR faults,\n"
        "clock jumps) and processes them by SP and WM in lockstep, open loop. The same drill and\n"
        "seed give the same output (\"hash\"). Exit status 1 if a drill failed; 3 if one could "
        "not\n"
        "be run, or if all were skipped (with --log, drills that need the simulator are skipped).\n"
        "Examples:\n"
        "  rcs drill --list\n"
        "  rcs drill --all -o out/drills\n"
        "  rcs drill config/drills/gps/d01_dropout_60s.toml --seeds 20 -o out/d01\n"
        "  rcs drill my_drill.toml --log run.log --config config/my_vehicle.toml --json");
  }

  int run() override {
    folder_ = command_line::find_config(folder_);
    scenario_ = command_line::find_config(scenario_);
    config_ = command_line::find_config(config_);
    if (all_ || full_ || list_) {
      const Result<std::vector<std::string>> found = drills_in(folder_);
      if (!found) return fail(kDrillName, found.error());
      paths_.insert(paths_.begin(), found->begin(), found->end());
    }
    if (paths_.empty()) {
      return wrong_usage(kDrillName, Error{"name drills, or use --all, --full or --list"});
    }
    if (logs_ && out_.empty()) {
      return wrong_usage(kDrillName, Error{"--logs requires an output folder (-o)"});
    }
    std::vector<drills::Drill> drills;
    for (const std::string& path : paths_) {
      Result<drills::Drill> drill = drills::load_drill(path);
      if (!drill) return fail(kDrillName, drill.error());
      const bool wanted = list_ || full_ || !all_ || !drill->full;
      if (wanted) drills.push_back(std::move(drill).value());
    }
    if (list_) return json_ ? list_json(drills) : list(drills);
    const Outcome done = run_all(std::move(drills));
    if (!done) return fail(kDrillName, done.error());
    return status();
  }

 private:
  static int list_json(const std::vector<drills::Drill>& drills) {
    report::Json json = {{"drills", report::Json::array()}};
    for (const drills::Drill& d : drills) {
      report::Json drill = {
          {"id", d.id}, {"name", d.name}, {"full", d.full}, {"stimuli", report::Json::array()}};
      for (const drills::Stimulus& s : d.stimuli) drill["stimuli"].push_back(drills::describe(s));
      json["drills"].push_back(std::move(drill));
    }
    fmt::print("{}", report::json_document("drill list", json));
    return kExitOk;
  }

  static int list(const std::vector<drills::Drill>& drills) {
    report::Table t{{"drill", "only with", "description", "stimuli"}, {}};
    for (const drills::Drill& d : drills) {
      std::string stimuli;
      for (const drills::Stimulus& s : d.stimuli) {
        stimuli += (&s == &d.stimuli.front() ? "" : ", ") + drills::describe(s);
      }
      t.rows.push_back({d.id, d.full ? "--full" : "", d.name, stimuli});
    }
    t.left = true;
    fmt::print("{}", to_text(t));
    return kExitOk;
  }

  template <typename Holds>
  [[nodiscard]] bool any(Holds holds) const {
    return std::any_of(results_.begin(), results_.end(), holds);
  }
  [[nodiscard]] bool all_skipped() const {
    return !any([](const drills::DrillResult& r) { return r.skipped.empty(); });
  }
  /// True if the results are not those of all drills that were requested (status 3).
  [[nodiscard]] bool prevented() const {
    return all_skipped() || any([](const drills::DrillResult& r) { return !r.error.empty(); });
  }

  [[nodiscard]] int status() const {
    if (all_skipped()) return fail(kDrillName, Error{"no drill could run on " + log_});
    if (prevented()) return kExitInput;
    return any([](const drills::DrillResult& r) { return r.verdict() == drills::Verdict::kFail; })
               ? kExitNegative
               : kExitOk;
  }

  Outcome run_all(std::vector<drills::Drill> drills) {
    Result<drills::DrillVehicle> vehicle = drills::load_drill_vehicle(config_);
    if (!vehicle) return vehicle.error();
    drills::DrillCampaign campaign;
    campaign.drills = std::move(drills);
    campaign.vehicle = std::move(vehicle).value();
    campaign.log = log_;
    campaign.scenario = scenario_;
    campaign.seeds = seeds_;
    campaign.full = full_;
    campaign.first_seed = first_seed_;
    if (logs_) campaign.logs_folder = out_;
    Result<std::vector<drills::DrillResult>> results =
        run_campaign_at_terminal(kDrillName, out_, jobs_, std::move(campaign));
    if (!results) return results.error();
    results_ = std::move(results).value();
    return print_results();
  }

  [[nodiscard]] Outcome print_results() const {
    const std::string json = report::json_document(kDrillName, to_json(results_));
    if (!json_) fmt::print("{}", to_text(drills::drill_table(results_)));
    if (json_ && !prevented()) fmt::print("{}", json);
    for (const drills::DrillResult& r : results_) {
      const std::string& why = r.error.empty() ? r.skipped : r.error;
      if (!why.empty()) fmt::print(stderr, "rcs drill: {}: {}\n", r.drill.id, why);
    }
    if (out_.empty()) return Done{};
    Outcome written = tools::write_text(out_ + "/results.json", json);
    if (written) written = tools::write_text(out_ + "/junit.xml", drills::to_junit(results_));
    const std::string& drive = log_.empty() ? scenario_ : log_;
    if (written) {
      written = tools::write_text(
          out_ + "/report.html",
          drills::drill_page(results_, drive, logs_ ? shell_word(out_) : "", page_origin(config_)));
    }
    return written;
  }

  std::vector<std::string> paths_;
  bool all_ = false;
  bool full_ = false;
  bool list_ = false;
  std::string folder_ = "config/drills";
  std::string scenario_ = "config/sim/drill.toml";
  std::string log_;
  std::string config_ = "config/demo3.toml";
  int seeds_ = 0;
  std::int64_t first_seed_ = 1;
  int jobs_ = 0;
  std::string out_;
  bool logs_ = false;
  bool json_ = false;
  std::vector<drills::DrillResult> results_;
};

}  // namespace

void add_drill_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<DrillCommand>(rcs));
}

}  // namespace rcs::cli
