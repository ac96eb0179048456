// sim SCENARIO: publishes the reference simulation on the LCM bus at real time.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "sim/real_time.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"

namespace {

using rcs::Outcome;
using rcs::Result;

struct Options {
  std::string scenario;
  std::string lcm_url;
  rcs::sim::ScenarioOverrides overrides;
  std::vector<std::tuple<std::string, double, double>> silences;  ///< source, begin, length [s]
};

int fail(const rcs::Error& error) {
  fmt::print(stderr, "sim: {}\n", error.message);
  return 1;
}

/// One line that is overwritten on a terminal; otherwise a line for each tenth of the drive.
class Progress {
 public:
  explicit Progress(double whole_s) : whole_s_(whole_s), terminal_(::isatty(STDERR_FILENO) == 1) {}

  void at(double share) {
    if (terminal_) {
      fmt::print(stderr, "\rsim: {:4.0f} of {:.0f} s", share * whole_s_, whole_s_);
    } else if (share >= next_share_) {
      fmt::print(stderr, "sim: {:4.0f} of {:.0f} s\n", share * whole_s_, whole_s_);
      next_share_ = 0.1 * (std::floor(10.0 * share) + 1.0);
    }
  }
  void end() const {
    if (terminal_) fmt::print(stderr, "\n");
  }

 private:
  double whole_s_;
  bool terminal_;
  double next_share_ = 0.0;
};

int run(const Options& options) {
  const Result<rcs::sim::Scenario> scenario =
      rcs::sim::load_scenario(options.scenario, options.overrides);
  if (!scenario) return fail(scenario.error());
  const rcs::StopSignals stop;
  const Result<std::unique_ptr<rcs::LcmBus>> bus = rcs::LcmBus::create(options.lcm_url);
  if (!bus) return fail(bus.error());
  rcs::sim::Simulator simulator(*scenario);
  fmt::print(stderr, "sim: {} on {}\n", options.scenario, (*bus)->url());
  rcs::LiveTimeline timeline(bus->get(), &stop);
  std::vector<rcs::sim::Silence> silences;
  for (const auto& [source, begin_s, length_s] : options.silences) {
    silences.push_back({source, begin_s, length_s});
  }
  Progress progress(rcs::seconds(simulator.end() - rcs::sim::Simulator::kStart));
  const rcs::sim::RealTimeReport report =
      rcs::sim::publish_at_real_time(&simulator, bus->get(), &timeline, silences,
                                     [&progress](double share) { progress.at(share); });
  progress.end();
  fmt::print(stderr, "sim: {}; largest lateness of a message {:.1f} ms\n",
             report.stopped ? "stopped" : "done", rcs::milliseconds(report.worst_late));
  if (simulator.commanded()) {
    fmt::print(stderr, "sim: {}\n", rcs::sim::drive_summary(simulator));
  }
  const Outcome status = (*bus)->status();
  return status ? 0 : fail(status.error());
}

int sim_main(int argc, char** argv) {
  CLI::App app(
      "Reference simulation: drives a scenario and publishes its sensors at real time. A scenario\n"
      "with [drive] mode = \"commanded\" receives BG_DRIVE, and stops without a valid command.",
      "sim");
  Options options;
  std::int64_t seed = 0;
  std::vector<double> outage_s;
  std::vector<double> ladar_outage_s;
  app.add_option("SCENARIO", options.scenario, "config/sim/*.toml")->required();
  app.add_option(
      "--lcm-url", options.lcm_url,
      fmt::format("URL of the LCM bus; default: $LCM_DEFAULT_URL, else {}", rcs::kDefaultLcmUrl));
  CLI::Option* const seed_option =
      app.add_option("--seed", seed, "seed of the noise, instead of that of the file");
  app.add_option("--ins", options.overrides.ins_grade, "INS grade: tactical, industrial, consumer");
  app.add_option("--gps-outage", outage_s,
                 "BEGIN,LENGTH [s] of a GPS outage, instead of those of the file")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--gps-lost-after", options.overrides.gps_lost_after_m,
                 "distance [m] after which GPS is lost for the rest of the drive, instead of that "
                 "of the file");
  app.add_option("--ladar-outage", ladar_outage_s,
                 "BEGIN,LENGTH [s] of a LADAR outage, instead of those of the file")
      ->delimiter(',')
      ->expected(2);
  app.add_option("--silence", options.silences,
                 "SOURCE,BEGIN,LENGTH: SOURCE publishes nothing from BEGIN s on for LENGTH "
                 "s;\nSOURCE is ins, gps, odometry, ladar or all")
      ->delimiter(',')
      ->check(CLI::Validator(
          [](std::string& value) {
            const bool number = value.find_first_not_of("0123456789.e+") == std::string::npos;
            const bool source = value == "ins" || value == "gps" || value == "odometry" ||
                                value == "ladar" || value == "all";
            return number || source ? std::string()
                                    : value + ": not ins, gps, odometry, ladar, all or seconds";
          },
          ""));
  app.footer("Example:\n  sim config/sim/demo.toml --gps-outage 60,60");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (seed_option->count() > 0) options.overrides.seed = seed;
  if (!outage_s.empty()) options.overrides.gps_outage = rcs::sim::Outage{outage_s[0], outage_s[1]};
  if (!ladar_outage_s.empty()) {
    options.overrides.ladar_outage = rcs::sim::Outage{ladar_outage_s[0], ladar_outage_s[1]};
  }
  return run(options);
}

}  // namespace

// This program throws nothing; an exception of a library at its start ends the process with its
// reason.
int main(int argc, char** argv) {
  try {
    return sim_main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "sim: %s\n", e.what());
    return 1;
  }
}
