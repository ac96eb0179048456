// sim SCENARIO: publishes the reference simulation on the LCM bus at real time.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/base/exit_status.h"
#include "rcs/command_line/parse.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "sim/real_time.h"
#include "sim/scenario_file.h"
#include "sim/sim_options.h"
#include "sim/simulator.h"

namespace {

using rcs::Outcome;
using rcs::Result;

using Options = rcs::sim::SimOptions;

int fail(const rcs::Error& error) {
  fmt::print(stderr, "sim: {}\n", error.message);
  return rcs::kExitInput;
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
  bool rejected = false;
  const auto at = [&](double share) {
    if (!rejected && simulator.rejected_commands() > 0) {
      rejected = true;
      fmt::print(stderr, "sim: {}: commands of a second publisher rejected\n",
                 rcs::channel::kBgDrive);
    }
    progress.at(share);
  };
  const rcs::sim::RealTimeReport report =
      rcs::sim::publish_at_real_time(&simulator, bus->get(), &timeline, silences, at);
  progress.end();
  fmt::print(stderr, "sim: {}; largest lateness of a message {:.1f} ms\n",
             report.stopped ? "stopped" : "done", rcs::milliseconds(report.worst_late));
  if (simulator.commanded()) {
    fmt::print(stderr, "sim: {}\n", rcs::sim::drive_summary(simulator));
  }
  const Outcome status = (*bus)->status();
  if (!status) return fail(status.error());
  return report.stopped ? rcs::kExitInterrupted : rcs::kExitOk;
}

int sim_main(int argc, char** argv) {
  CLI::App app;
  Options options;
  rcs::sim::add_sim_options(&app, &options);
  if (const auto ended = rcs::command_line::parse(&app, argc, argv)) {
    return rcs::command_line::print(*ended);
  }
  const auto outage = [](const std::vector<double>& s) -> std::optional<rcs::sim::Outage> {
    if (s.empty()) return std::nullopt;
    return rcs::sim::Outage{s[0], s[1]};
  };
  options.overrides.gps_outage = outage(options.gps_outage_s);
  options.overrides.ladar_outage = outage(options.ladar_outage_s);
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
    return rcs::kExitInput;
  }
}
