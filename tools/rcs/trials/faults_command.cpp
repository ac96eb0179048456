// rcs faults

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <numeric>
#include <set>
#include <utility>

#include "rcs/command_line/config_files.h"
#include "sim/scenario_file.h"
#include "tools/base/files.h"
#include "tools/drills/fault_metrics.h"
#include "tools/rcs/campaign_terminal.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kFaultsName = "faults";
constexpr std::size_t kShown = 30;  // runs outside of a limit

/// The file of results: a line with the plan, then one for each run. It is rewritten after every
/// run, so that it is complete whenever the command ends.
class RunsFile {
 public:
  RunsFile(std::string path, std::string plan) : path_(std::move(path)), plan_(std::move(plan)) {}

  /// Reads the completed runs.
  Outcome read(std::vector<drills::FaultRun>* runs) const {
    std::ifstream in(path_);
    std::string line;
    if (!in.is_open() || !std::getline(in, line)) return Done{};
    if (line != plan_) {
      return Error{path_ +
                   ": has the runs of another series; name another folder with -o, or remove it"};
    }
    while (std::getline(in, line)) {
      Result<drills::FaultRun> run = drills::parse_json_line(line);
      if (!run) return Error{path_ + ": " + run.error().message};
      runs->push_back(std::move(run).value());
    }
    return Done{};
  }

  [[nodiscard]] Outcome write(const std::vector<drills::FaultRun>& runs) const {
    std::string text = plan_ + "\n";
    for (const drills::FaultRun& run : runs) text += drills::to_json_line(run) + "\n";
    return tools::write_text(path_, text);
  }

 private:
  std::string path_, plan_;
};

class FaultsCommand final : public Command {
 public:
  explicit FaultsCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "faults", "Inject randomly drawn faults of every sensor and tabulate the errors")) {
    app()
        ->add_option("--runs", runs_, "number of drives")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    add_list(app(), "--run", &only_runs_,
             "drives of the series, by number, instead of the first --runs; with -o only their\n"
             "logs are written (rcs why)")
        ->check(CLI::NonNegativeNumber);
    app()
        ->add_option("--faults", plan_.faults, "faults at the same time, of different sensors")
        ->check(CLI::Range(1, 2))
        ->capture_default_str();
    add_list(app(), "--only", &plan_.only, "classes of faults or sensors to draw from (--list)")
        ->type_name("NAME");
    add_repeated(app(), "--scenario", &plan_.scenarios, "scenarios of the drives")
        ->transform(command_line::config_file())
        ->capture_default_str();
    app()
        ->add_option("--first-seed", plan_.first_seed,
                     "seed of the faults, and first seed of the noise and the terrain")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->type_name("FILE")
        ->capture_default_str();
    app()
        ->add_option("--jobs", jobs_, "parallel runs; default: one per core")
        ->check(CLI::Range(1, 256));
    app()
        ->add_option("-o,--out", out_,
                     "folder for runs.jsonl (one line a run) and faults.json; a series that was\n"
                     "interrupted is continued")
        ->type_name("FOLDER");
    app()->add_flag("--list", list_, "list the classes of faults with their ranges");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "Each drive is simulated and processed by SP and WM in lockstep. The fault begins after "
        "30\n"
        "to 45 s and lasts 2 to 40 s (a silence 0.1 to 5 s); its class, size, axis, sign, begin "
        "and\n"
        "length, and whether GPS is lost from 5 s before until 5 s after it, are drawn. Every "
        "class\n"
        "is drawn equally often. Limits: horizontal error 2 m, or without GPS 1 % of the distance\n"
        "driven since the fault began if that is more; 99.9 % of the time within the protection\n"
        "levels; no missed alert; no sensor excluded that has no fault. Exit status 1 if a run is\n"
        "outside of a limit.\n"
        "Examples:\n"
        "  rcs faults --list\n"
        "  rcs faults -o out/faults                         # 600 drives, an hour; Ctrl-C and\n"
        "                                                   # the same command continue it\n"
        "  rcs faults --runs 60 --only ins --first-seed 501 -o out/ins\n"
        "  rcs faults --runs 200 --faults 2 -o out/two\n"
        "  rcs faults --run 137 -o out/run137               # one of the 600, with its log\n"
        "  rcs why out/run137/f0137.log 60");
  }

  int run() override {
    if (list_) return list();
    const std::vector<std::size_t> selected = drills::selected_classes(plan_.only);
    for (const std::string& name : plan_.only) {
      if (drills::selected_classes({name}).empty()) {
        return wrong_usage(kFaultsName, Error{"--only " + name + ": no such class; see --list"});
      }
    }
    std::set<drills::DrillSource> sources;
    for (std::size_t k : selected) sources.insert(drills::fault_classes()[k].source);
    if (static_cast<int>(sources.size()) < plan_.faults) {
      return wrong_usage(kFaultsName, Error{"--faults: --only leaves too few sensors"});
    }
    for (std::string& scenario : plan_.scenarios) {
      scenario = command_line::find_config(scenario);
      const Result<sim::Scenario> valid = sim::load_scenario(scenario, {});
      if (!valid) return fail(kFaultsName, valid.error());
    }
    config_ = command_line::find_config(config_);
    const Outcome done = run_all();
    if (!done) return fail(kFaultsName, done.error());
    if (any_failed()) return kExitInput;
    return passed() ? kExitOk : kExitNegative;
  }

 private:
  [[nodiscard]] int list() const {
    if (json_) {
      report::Json json = {{"classes", report::Json::array()}};
      for (const drills::FaultClass& c : drills::fault_classes()) {
        json["classes"].push_back(
            {{"name", c.name}, {"sensor", source_name(c.source)}, {"range", c.about}});
      }
      fmt::print("{}", report::json_document("faults list", json));
      return kExitOk;
    }
    report::Table t{{"class", "sensor", "range"}, {}};
    for (const drills::FaultClass& c : drills::fault_classes()) {
      t.rows.push_back(
          {std::string(c.name), std::string(source_name(c.source)), std::string(c.about)});
    }
    fmt::print("{}", to_text(t));
    return kExitOk;
  }

  /// Runs of the same plan continue each other.
  [[nodiscard]] std::string plan_line() const {
    report::Json json = {{"faults", plan_.faults},
                         {"first_seed", plan_.first_seed},
                         {"only", plan_.only},
                         {"scenarios", plan_.scenarios},
                         {"config", config_}};
    return json.dump();
  }

  Outcome run_all() {
    Result<drills::DrillVehicle> vehicle = drills::load_drill_vehicle(config_);
    if (!vehicle) return vehicle.error();
    std::optional<RunsFile> file;
    if (!out_.empty() && only_runs_.empty()) {
      file.emplace(out_ + "/runs.jsonl", plan_line());
      if (Outcome read = file->read(&results_); !read) return read;
    }
    std::set<int> completed;
    for (const drills::FaultRun& r : results_) completed.insert(r.index);

    drills::DrillCampaign campaign;
    campaign.vehicle = std::move(vehicle).value();
    campaign.seeds = 1;
    campaign.keep_records = false;
    std::vector<drills::RandomFault> faults;
    std::vector<int> indices;
    std::vector<int> wanted = only_runs_;
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    if (wanted.empty()) {
      wanted.resize(static_cast<std::size_t>(runs_));
      std::iota(wanted.begin(), wanted.end(), 0);
    } else {
      campaign.logs_folder = out_;
    }
    for (const int index : wanted) {
      if (completed.count(index) > 0) continue;
      faults.push_back(drills::random_fault(plan_, index));
      faults.back().drill.seed = faults.back().seed;
      campaign.drills.push_back(faults.back().drill);
      indices.push_back(index);
    }
    std::mutex writing;
    Outcome written = Done{};
    campaign.look = [&](std::size_t drill, std::size_t /*run*/, const drills::DrillRecord& record) {
      const drills::FaultRun run = drills::fault_run(faults[drill], indices[drill], record);
      const std::lock_guard<std::mutex> lock(writing);
      results_.push_back(run);
      if (file && written) written = file->write(results_);
    };
    const Result<std::vector<drills::DrillResult>> done =
        run_campaign_at_terminal(kFaultsName, out_, jobs_, std::move(campaign));
    if (!done) return done.error();
    if (!written) return written;
    for (std::size_t k = 0; k < done->size(); ++k) {
      if ((*done)[k].error.empty()) continue;
      drills::FaultRun failed;
      failed.index = indices[k];
      failed.description = faults[k].drill.name;
      failed.error = (*done)[k].error;
      results_.push_back(failed);
      fmt::print(stderr, "rcs faults: run {}: {}\n", failed.index, failed.error);
    }
    std::sort(results_.begin(), results_.end(),
              [](const auto& a, const auto& b) { return a.index < b.index; });
    return print_results();
  }

  /// True if a file or the system prevented a run.
  [[nodiscard]] bool any_failed() const {
    return std::any_of(results_.begin(), results_.end(),
                       [](const drills::FaultRun& r) { return !r.error.empty(); });
  }

  [[nodiscard]] bool passed() const {
    const report::Json sums = drills::fault_summary(results_);
    for (const char* key : {"above_limit", "outside_level", "missed_alerts", "wrongly_excluded"}) {
      if (sums.at(key).get<int>() > 0) return false;
    }
    return true;
  }

  [[nodiscard]] Outcome print_results() const {
    report::Json json = {{"summary", drills::fault_summary(results_)},
                         {"runs", report::Json::array()}};
    for (const drills::FaultRun& r : results_) {
      json["runs"].push_back(report::Json::parse(drills::to_json_line(r)));
    }
    const std::string text = report::json_document(kFaultsName, json);
    if (json_) {
      if (!any_failed()) fmt::print("{}", text);
    } else {
      const report::Table violations = drills::violation_table(results_, kShown);
      fmt::print("{}", to_text(drills::fault_table(results_)));
      if (!violations.rows.empty()) {
        fmt::print("\nRuns outside of a limit:\n{}", to_text(violations));
      }
    }
    if (out_.empty() || !only_runs_.empty()) return Done{};
    return tools::write_text(out_ + "/faults.json", text);
  }

  drills::RandomFaultPlan plan_{
      {"config/sim/drill.toml", "config/sim/steep_ridge.toml", "config/sim/tall_grass.toml",
       "config/sim/town.toml", "config/sim/desert.toml"},
      1,
      1,
      10,
      {}};
  int runs_ = 600;
  std::vector<int> only_runs_;
  std::string config_ = "config/demo3.toml";
  int jobs_ = 0;
  std::string out_;
  bool list_ = false;
  bool json_ = false;
  std::vector<drills::FaultRun> results_;
};

}  // namespace

void add_faults_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<FaultsCommand>(rcs));
}

}  // namespace rcs::cli
