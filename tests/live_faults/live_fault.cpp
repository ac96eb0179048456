#include "tests/live_faults/live_fault.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "rcs/node/report.h"

namespace rcs::live_faults {
namespace {

constexpr std::size_t kMaxEvents = 40;

}  // namespace

int number_from(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): one thread
  const int number = text == nullptr ? 0 : std::atoi(text);  // NOLINT(cert-err34-c): 0: no number
  return number > 0 ? number : otherwise;
}

double resident_mb(int pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  double all = 0.0;
  double resident = 0.0;
  statm >> all >> resident;
  return resident * 4096.0 * 1e-6;
}

LiveFault::LiveFault(const std::string& vehicle_toml, const std::vector<std::string>& sim_arguments)
    : run(vehicle_toml, sim_arguments) {
  Bus* const bus = run.bus();
  if (bus == nullptr) return;  // run.trouble() has the reason
  for (const std::string& node : kNodes) {
    cycles_.emplace_back(bus, channel_of(node, "CYCLE"), [this](const cycle_t& m, Stamp arrival) {
      counts.take(m);
      recovery.take(m, arrival);
    });
    processes_.emplace_back(bus, channel_of(node, "PROCESS"),
                            [this](const process_t& m, Stamp) { counts.take(m); });
    events_.emplace_back(bus, channel_of(node, "EVENT"), [this](const event_t& m, Stamp arrival) {
      events.push_back(fmt::format("{:.2f} {} {}: {}", 1e-6 * double(to_utime(arrival)), m.node,
                                   m.code, m.text));
      if (events.size() > kMaxEvents) events.pop_front();
    });
  }
  truths_.emplace_back(bus, channel::kSimTruth, [this](const truth_t& m, Stamp arrival) {
    safety.take(m, arrival);
    counts.take(m);
    look();
  });
  drives_.emplace_back(bus, channel::kBgDrive, [this](const drive_t& m, Stamp) { safety.take(m); });
  nav_states_.emplace_back(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp arrival) {
    safety.take(m);
    recovery.take(m, arrival);
  });
  commands_.emplace_back(bus, channel::kBgCommand, [this](const command_t& m, Stamp) {
    safety.take(m);
    counts.take(m);
  });
  statuses_.emplace_back(bus, channel::kBgStatus, [this](const status_t& m, Stamp arrival) {
    counts.take(m);
    recovery.take(m, arrival);
  });
  registrations_.emplace_back(bus, channel::kSpRegistration,
                              [this](const registration_t& m, Stamp) { counts.take(m); });
  innovations_.emplace_back(bus, channel::kWmInnovation,
                            [this](const innovation_t& m, Stamp) { counts.take(m); });
}

LiveFault::~LiveFault() {
  if (!testing::Test::HasFailure()) return;
  std::printf("output of the processes, and their recording if there is one: %s\n",
              run.keep_files().c_str());
}

void LiveFault::look() {
  recovery.look(run.now(), safety.speed_mps());
  run.set_next_waypoint(counts.next_waypoint());
}

bool LiveFault::run_until_well(Duration most) {
  return run.run_until(run.now() + most, [this] { return recovery.recovered().has_value(); });
}

std::string LiveFault::breaches() const {
  std::string text;
  for (const std::string& b : safety.breaches()) text += "  " + b + "\n";
  for (const std::string& b : counts.breaches()) text += "  " + b + "\n";
  return text;
}

}  // namespace rcs::live_faults
