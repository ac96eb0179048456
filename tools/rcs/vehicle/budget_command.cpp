// rcs budget

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/params/params.h"
#include "rcs/node/process/process.h"
#include "tools/base/files.h"
#include "tools/evaluation/budget_metrics.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/budget_run.h"
#include "tools/rcs/vehicle/child_process.h"
#include "tools/rcs/vehicle/private_bus.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kBudgetName = "budget";

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) text += text.empty() ? word : separator + word;
  return text;
}

/// Load of the computer: the mean number of runnable processes.
std::string load_average() {
  std::ifstream file("/proc/loadavg");
  std::string one;
  std::string five;
  file >> one >> five;
  return one;
}

class Budget final : public Command {
 public:
  explicit Budget(CLI::App* rcs)
      : Command(rcs->add_subcommand("budget",
                                    "Play a log to live nodes and compare their times with the "
                                    "limits in [budget]")) {
    app()
        ->add_option("CONFIG", plan_.config, "the vehicle's configuration (TOML)")
        ->required()
        ->transform(command_line::config_file());
    app()
        ->add_option("LOG", plan_.log, "log with sensor channels; other channels are ignored")
        ->required()
        ->check(CLI::ExistingFile);
    add_list(app(), "--load", &plan_.load, "additional load on the computer")
        ->check(CLI::IsMember({"cpu", "io", "memory"}));
    app()
        ->add_option("--seconds", seconds_,
                     "time to play. A shorter log is repeated with new processes, and the results\n"
                     "are pooled. Default: the log once")
        ->check(CLI::Range(1.0, 86400.0));
    app()
        ->add_option("--svg", svg_, "write histograms of the latencies of the scans as an SVG file")
        ->type_name("FILE");
    app()->add_flag("--json", json_, "print the results as JSON");
    app()
        ->add_option(
            "--lcm-url", plan_.lcm_url,
            "existing LCM bus, instead of a private one; other traffic disturbs the results")
        ->type_name("URL");
    app()->footer(
        "Starts the nodes of [up] (default sp, wm) with CONFIG on a private bus, plays the sensor\n"
        "data of LOG in real time, and accounts for every scan. bg receives goals ahead of the\n"
        "vehicle, so that it plans. Times are from the latency traces of the messages and, within\n"
        "a cycle, from the measurements of the nodes; a chain begins when the last facet is sent.\n"
        "Exit status 1 if a limit of [budget] is exceeded:\n"
        "  facet_to_nav_state_{p50,p99,p999,max}_ms, facet_to_drive_{p50,p99,p999,max}_ms,\n"
        "  unaccounted_scans (default 0), {degraded,held,failed,dropped}_share of the scans,\n"
        "  overrun_share of the cycles of each node\n"
        "Examples:\n"
        "  rcs sim config/sim/demo.toml -o demo.log\n"
        "  rcs budget config/demo3.toml demo.log --seconds 60 --svg idle.svg\n"
        "  rcs budget config/demo3.toml demo.log --seconds 60 --load cpu,io --json > loaded.json");
  }

  int run() override {
    const Result<ParamFile> params = ParamFile::load(plan_.config);
    if (!params) return fail(kBudgetName, params.error());
    const Result<evaluation::BudgetLimits> limits = evaluation::read_budget_limits(*params);
    if (!limits) return fail(kBudgetName, limits.error());
    const Result<ProcessTables> tables = read_process_tables(*params);
    if (!tables) return fail(kBudgetName, tables.error());
    plan_.nodes = tables->nodes;
    for (const std::string& node : plan_.nodes) {
      if (const Result<std::string> program = find_program(node); !program) {
        return fail(kBudgetName, program.error());
      }
    }
    if (plan_.lcm_url.empty()) {
      if (const Outcome inside = enter_private_bus(); !inside)
        return fail(kBudgetName, inside.error());
      plan_.lcm_url = kDefaultLcmUrl;
    }
    const Result<Duration> length = length_of_log();
    if (!length) return fail(kBudgetName, length.error());
    plan_.length = seconds_ > 0.0 ? from_seconds(seconds_) : *length;
    print_plan(*length);

    const std::string load_before = load_average();
    Result<BudgetRun> run = [&] {
      Progress progress(kBudgetName, 1000);
      return run_budget(
          plan_, [&](double share) { progress.at(static_cast<std::int64_t>(1000.0 * share)); });
    }();
    if (!run) return fail(kBudgetName, run.error());
    return print_results(*run, *limits, load_before);
  }

 private:
  [[nodiscard]] Result<Duration> length_of_log() const {
    Result<LogReader> reader = LogReader::open(plan_.log);
    if (!reader) return reader.error();
    LogEvent event;
    Stamp first = Stamp::max();
    Stamp last = Stamp::min();
    while (reader->next(&event)) {
      first = std::min(first, event.stamp);
      last = std::max(last, event.stamp);
    }
    if (last <= first) return Error{plan_.log + ": fewer than two events at different times"};
    return last - first + Duration(1);
  }

  [[nodiscard]] std::string loads() const {
    return plan_.load.empty() ? "none" : joined(plan_.load, ", ");
  }

  void print_plan(Duration log) const {
    const double laps = seconds(plan_.length) / seconds(log);
    fmt::print(stderr, "rcs budget: {} for {:.0f} s, log of {:.1f} s{}, load: {}\n",
               joined(plan_.nodes, ", "), seconds(plan_.length), seconds(log),
               laps > 1.0 ? fmt::format(" ({} laps, new processes each)", std::ceil(laps)) : "",
               loads());
  }

  [[nodiscard]] int print_results(const BudgetRun& run, const evaluation::BudgetLimits& limits,
                                  const std::string& load_before) const {
    const std::vector<evaluation::BudgetVerdict> verdicts = judge(run.record, limits);
    if (!svg_.empty()) {
      const std::string title =
          fmt::format("{} scans in real time, load: {}", run.record.scans.sent, loads());
      const Outcome written = tools::write_text(
          svg_, report::render(evaluation::budget_plot(run.record, limits, title), true));
      if (!written) return fail(kBudgetName, written.error());
    }
    if (json_) {
      evaluation::Json json = to_json(run.record, verdicts);
      json["config"] = plan_.config;
      json["log"] = plan_.log;
      json["load"] = plan_.load;
      json["played_s"] = seconds(run.played);
      json["interrupted"] = run.interrupted;
      json["load_average_before"] = load_before;
      json["player_max_delay_ms"] = milliseconds(run.worst_send);
      json["messages_not_received"] = run.missed_here;
      fmt::print("{}", report::json_document(kBudgetName, json));
    } else {
      fmt::print("{}\n{}\n{}\n{}", to_text(evaluation::hop_table(run.record)),
                 to_text(evaluation::stage_table(run.record)),
                 to_text(evaluation::account_table(run.record)),
                 to_text(evaluation::verdict_table(verdicts)));
    }
    fmt::print(stderr,
               "rcs budget: {:.0f} s played in {} lap{}; load average before {}; maximum delay of "
               "the player {:.1f} ms; {} messages of the nodes not received\n",
               seconds(run.played), run.record.laps, run.record.laps == 1 ? "" : "s", load_before,
               milliseconds(run.worst_send), run.missed_here);
    return verdict(run, verdicts);
  }

  [[nodiscard]] static int verdict(const BudgetRun& run,
                                   const std::vector<evaluation::BudgetVerdict>& verdicts) {
    int status = kExitOk;
    for (const evaluation::BudgetVerdict& v : verdicts) {
      if (v.kept()) continue;
      status = kExitNegative;
      if (v.measured) {
        fmt::print(stderr, "rcs budget: limit exceeded: {} is {:.6g}, limit {:g}\n", v.name,
                   v.value, v.limit);
      } else {
        fmt::print(stderr, "rcs budget: not measured: {}, limit {:g}\n", v.name, v.limit);
      }
    }
    if (run.interrupted) {
      fmt::print(stderr, "rcs budget: interrupted; the results are incomplete\n");
      return kExitInterrupted;
    }
    return status;
  }

  BudgetPlan plan_;
  double seconds_ = 0.0;
  std::string svg_;
  bool json_ = false;
};

}  // namespace

void add_budget_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Budget>(rcs));
}

}  // namespace rcs::cli
