// The whole vehicle drives for an hour; every 20 s a random fault: a node is killed, stopped or
// ended, `rcs up` is stopped, a channel is flooded, or sensors fall silent. No motion may be unsafe
// and the vehicle drives in the end. RCS_SOAK_MINUTES: duration, default 60; RCS_SOAK_SEED: of the
// faults, default 1.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/live_faults/live_fault.h"
#include "tools/base/statistics.h"
#include "tools/report/table.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr double kFirst_s = 60.0;
constexpr double kEvery_s = 20.0;
constexpr double kLongest_s = 3.0;  // of a fault

enum class Kind { kKill, kStop, kEnd, kStopUp, kFlood, kSilence };

struct Fault {
  Kind kind = Kind::kKill;
  std::string what;      ///< node, channel or sensor
  double begin_s = 0.0;  ///< since the start of the simulator
  double length_s = 0.0;

  [[nodiscard]] std::string name() const {
    constexpr const char* kNames[] = {
        "kill -9", "stop of", "end of", "stop of", "10,000 a second on", "silence of"};
    return fmt::format("{} {}", kNames[static_cast<std::size_t>(kind)], what);
  }
};

std::vector<Fault> random_faults(double duration_s, unsigned seed) {
  std::mt19937 random(seed);
  const auto one_of = [&](const std::vector<std::string>& names) {
    return names[std::uniform_int_distribution<std::size_t>(0, names.size() - 1)(random)];
  };
  std::uniform_int_distribution<int> kinds(0, 5);
  std::uniform_real_distribution<double> later_s(0.0, 5.0);
  std::uniform_real_distribution<double> length_s(0.1, kLongest_s);
  std::vector<Fault> faults;
  for (double begin_s = kFirst_s; begin_s + kEvery_s < duration_s; begin_s += kEvery_s) {
    Fault f;
    f.kind = static_cast<Kind>(kinds(random));
    f.begin_s = begin_s + later_s(random);
    f.length_s = length_s(random);
    switch (f.kind) {
      case Kind::kKill:
      case Kind::kStop:
      case Kind::kEnd:
        f.what = one_of(kNodes);
        break;
      case Kind::kStopUp:
        f.what = "rcs up";
        break;
      case Kind::kFlood:
        f.what = one_of({channel::kIns, channel::kGpsFix, channel::kOdometry, channel::kLadarRanges,
                         channel::kSpRegistration, channel::kWmMapPatch, channel::kBgCommand,
                         channel::kBgStop, channel::kUpProcess});
        break;
      case Kind::kSilence:
        f.what = one_of({"ins", "gps", "odometry", "ladar", "all"});
        break;
    }
    faults.push_back(f);
  }
  return faults;
}

/// The simulator is silent by itself, at its own time.
std::vector<std::string> silences_of(const std::vector<Fault>& faults) {
  std::vector<std::string> arguments;
  for (const Fault& f : faults) {
    if (f.kind != Kind::kSilence) continue;
    arguments.insert(arguments.end(),
                     {"--silence", fmt::format("{},{:.2f},{:.2f}", f.what, f.begin_s, f.length_s)});
  }
  return arguments;
}

void inject(const Fault& f, VehicleRun* run) {
  const auto wait = [&] { (void)run->run_until(run->now() + from_seconds(f.length_s), {}); };
  switch (f.kind) {
    case Kind::kKill:
    case Kind::kEnd:
      run->send_signal(f.what, f.kind == Kind::kKill ? SIGKILL : SIGTERM);
      break;
    case Kind::kStop:
      run->send_signal(f.what, SIGSTOP);
      wait();
      run->send_signal(f.what, SIGCONT);
      break;
    case Kind::kStopUp:
      run->send_signal_to_up(SIGSTOP);
      wait();
      run->send_signal_to_up(SIGCONT);
      break;
    case Kind::kFlood:
      EXPECT_EQ(run->run_program("flood_bus", {f.what, "10000", fmt::format("{:.1f}", f.length_s)},
                                 kPatience),
                0)
          << f.what;
      break;
    case Kind::kSilence:
      wait();
      break;
  }
}

struct Outcome {
  int times = 0;
  std::vector<double> recovery_s;  ///< from the end of the fault; only before the next fault
};

TEST(FaultSoak, ARandomFaultEveryTwentySeconds) {
  const double duration_s = 60.0 * number_from("RCS_SOAK_MINUTES", 60);
  const auto seed = static_cast<unsigned>(number_from("RCS_SOAK_SEED", 1));
  const std::vector<Fault> faults = random_faults(duration_s, seed);
  LiveFault live("", silences_of(faults));
  ASSERT_EQ(live.run.trouble(), "");
  live.run.record();
  const Stamp start = live.run.now();
  ASSERT_TRUE(live.run_until_well(kPatience)) << live.recovery.missing();
  live.safety.reset();
  std::map<std::string, Outcome> outcomes;
  std::size_t seen = 0;  // violations
  for (std::size_t k = 0; k < faults.size() && live.run.trouble().empty(); ++k) {
    const Fault& f = faults[k];
    (void)live.run.run_until(start + from_seconds(f.begin_s), {});
    inject(f, &live.run);
    const Stamp ended = live.run.now();
    live.recovery.reset();
    const Stamp next =
        start + from_seconds(k + 1 < faults.size() ? faults[k + 1].begin_s : f.begin_s + kEvery_s);
    Outcome& o = outcomes[f.name()];
    ++o.times;
    if (live.run_until_well(next - ended)) {
      o.recovery_s.push_back(seconds(*live.recovery.recovered() - ended));
    }
    for (; seen < live.safety.breaches().size(); ++seen) {
      ADD_FAILURE() << f.name() << " for " << f.length_s << " s, " << f.begin_s
                    << " s after the start: " << live.safety.breaches()[seen];
    }
    std::fprintf(stderr, "%3zu of %zu: %s\n", k + 1, faults.size(), f.name().c_str());
  }
  live.recovery.reset();
  EXPECT_TRUE(live.run_until_well(kPatience)) << live.recovery.missing();
  for (; seen < live.safety.breaches().size(); ++seen) {
    ADD_FAILURE() << "after the last fault: " << live.safety.breaches()[seen];
  }
  const SafetyMetrics driven = live.safety.metrics();
  report::Table table;
  table.header = {"fault", "times", "recovered before the next", "median s", "max s"};
  for (const auto& [name, o] : outcomes) {
    const tools::Summary s = tools::summarize(o.recovery_s);
    table.rows.push_back({name, std::to_string(o.times), std::to_string(o.recovery_s.size()),
                          fmt::format("{:.1f}", s.p50), fmt::format("{:.1f}", s.max)});
  }
  std::printf("%s%zu faults, seed %u: %.0f m driven, %d collisions, least clearance %.2f m\n%s\n",
              to_text(table).c_str(), faults.size(), seed, driven.driven_m, driven.collisions,
              driven.clearance_m, live.run.end().c_str());
  EXPECT_EQ(live.run.trouble(), "");
}

}  // namespace
}  // namespace rcs::live_faults
