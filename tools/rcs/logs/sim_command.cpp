// rcs sim

#include <fmt/format.h>

#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/live_timeline.h"
#include "sim/real_time.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"
#include "tools/base/files.h"
#include "tools/mapping/map_writer.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kSimName = "sim";

class Sim final : public Command {
 public:
  explicit Sim(CLI::App* rcs)
      : Command(
            rcs->add_subcommand("sim", "Run the reference simulation into a log or on the bus")) {
    app()
        ->add_option("SCENARIO", scenario_, "scenario (TOML), e.g. config/sim/demo.toml")
        ->required()
        ->transform(command_line::config_file());
    CLI::Option* out =
        app()
            ->add_option(
                "-o,--out", out_,
                "output log, written as fast as possible; default: publish on the bus in real time")
            ->type_name("FILE");
    app()->add_option("--seed", overrides_.seed,
                      "seed of the noise, instead of that of the scenario");
    app()
        ->add_option(
            "--ins", overrides_.ins_grade,
            "INS grade (tactical, industrial or consumer), instead of that of the scenario")
        ->type_name("GRADE");
    app()
        ->add_option("--duration", overrides_.duration_s,
                     "duration of the drive [s], instead of that of the scenario")
        ->check(CLI::Range(0.1, 1e6));
    constexpr double kLongest_s = 1e6;
    add_numbers(app(), "--gps-outage", &gps_outage_s_, "BEGIN,LENGTH", 0.0, kLongest_s,
                "begin and length of a GPS outage [s], instead of the outages of the scenario");
    app()->add_option("--gps-lost-after", overrides_.gps_lost_after_m,
                      "distance after which GPS is lost for the rest of the drive [m], instead of "
                      "that of the scenario");
    add_numbers(app(), "--ladar-outage", &ladar_outage_s_, "BEGIN,LENGTH", 0.0, kLongest_s,
                "begin and length of a LADAR outage [s], instead of the outages of the scenario");
    app()
        ->add_option("--prior-map", prior_map_,
                     "write the a priori map of the course to this folder")
        ->type_name("FOLDER");
    add_bus_option(app(), &lcm_url_)->excludes(out);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The same scenario and seed give the same bytes. Ctrl-C leaves no partial log behind; an\n"
        "existing file stays unchanged. A scenario with [drive] mode = \"commanded\" receives\n"
        "BG_DRIVE from the bus; with --out its vehicle stands still.\n"
        "Examples:\n"
        "  rcs sim config/sim/reference.toml -o out/sim.log --seed 7\n"
        "  rcs sim config/sim/demo.toml --gps-outage 60,60");
  }

  int run() override {
    if (!gps_outage_s_.empty()) {
      overrides_.gps_outage = sim::Outage{gps_outage_s_[0], gps_outage_s_[1]};
    }
    if (!ladar_outage_s_.empty()) {
      overrides_.ladar_outage = sim::Outage{ladar_outage_s_[0], ladar_outage_s_[1]};
    }
    const Result<sim::Scenario> scenario = sim::load_scenario(scenario_, overrides_);
    if (!scenario) return fail(kSimName, scenario.error());
    const Outcome done = out_.empty() ? onto_bus(*scenario) : into_log(*scenario);
    return done ? kExitOk : fail(kSimName, done.error());
  }

 private:
  [[nodiscard]] Outcome write_prior_map(const sim::Simulator& simulator) const {
    if (prior_map_.empty()) return Done{};
    const sim::PriorMap map = simulator.prior_map();
    return mapping::write_map(prior_map_, map.frame, map.raster);
  }

  [[nodiscard]] Outcome onto_bus(const sim::Scenario& scenario) const {
    const StopSignals stop;
    const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(lcm_url_);
    if (!bus) return bus.error();
    sim::Simulator simulator(scenario);
    if (Outcome map = write_prior_map(simulator); !map) return map;
    fmt::print(stderr, "rcs sim: on {}\n", (*bus)->url());
    LiveTimeline timeline(bus->get(), &stop);
    sim::RealTimeReport report;
    {
      Progress progress(kSimName, 1000);
      report = sim::publish_at_real_time(&simulator, bus->get(), &timeline, {}, [&](double share) {
        progress.at(static_cast<std::int64_t>(1000.0 * share));
      });
    }
    fmt::print(stderr, "rcs sim: {}; maximum delay of a message {:.1f} ms\n",
               report.stopped ? "stopped" : "done", milliseconds(report.worst_late));
    if (simulator.commanded()) fmt::print(stderr, "rcs sim: {}\n", sim::drive_summary(simulator));
    print_json({{"url", (*bus)->url()}, {"max_delay_ms", milliseconds(report.worst_late)}});
    if (Outcome status = (*bus)->status(); !status || !report.stopped) return status;
    note_interrupt();
    return Error{"interrupted"};
  }

  [[nodiscard]] Outcome into_log(const sim::Scenario& scenario) const {
    tools::OutputFile out(out_);
    if (Outcome checked = out.check(); !checked) return checked;
    Result<LogWriter> writer = LogWriter::create(out.write_path());
    if (!writer) return writer.error();
    Progress progress(kSimName, Progress::kSteps);  // from the creation of the world on
    sim::Simulator simulator(scenario);
    if (Outcome map = write_prior_map(simulator); !map) return map;

    const InterruptGuard interrupt;
    const double length_s = seconds(simulator.end() - sim::Simulator::kStart);
    SourceEvent event;
    for (Stamp due = simulator.peek(); due != Stamp::max(); due = simulator.peek()) {
      if (interrupt.requested()) return Error{"interrupted"};
      simulator.take(&event);
      // close() returns the first failure.
      (void)writer->write(due, event.channel, event.data.data(), event.data.size());
      progress.at_share(seconds(due - sim::Simulator::kStart) / length_s);
    }
    if (Outcome closed = writer->close(); !closed) return closed;
    if (Outcome done = out.commit(); !done) return done;
    print_json({{"log", out_}, {"events", writer->events()}});
    return Done{};
  }

  void print_json(const report::Json& result) const {
    if (!json_) return;
    report::Json json = {{"scenario", scenario_}};
    json.update(result);
    fmt::print("{}", report::json_document(kSimName, json));
  }

  std::string scenario_;
  std::string out_;
  std::string prior_map_;
  std::string lcm_url_;
  std::vector<double> gps_outage_s_;
  std::vector<double> ladar_outage_s_;
  sim::ScenarioOverrides overrides_;
  bool json_ = false;
};

}  // namespace

void add_sim_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Sim>(rcs));
}

}  // namespace rcs::cli
