// Random sequences with a live vehicle that an operator keeps commanding: stops and releases of
// three issuers, of `rcs go` and of operators over DDS, kill -9 of nodes and of `rcs up`, and
// replayed, forged, expired and future commands. From the cycle of a stop on BG commands full brake
// only, and once at rest the vehicle does not move before the release of every stop. The sequences
// in lockstep (tests/bg/stop_sequences_test.cpp) are drawn by the same generator and judged by the
// same law. RCS_DRILL_TIMES: sequences, default 60; RCS_SEQUENCE_SEED: of the first, default 1.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/outbox.h"
#include "tests/live_faults/live_fault.h"
#include "tests/live_faults/stop_judge.h"
#include "tools/base/statistics.h"

namespace rcs::live_faults {
namespace {

using bg::test::DrawnEvent;
using bg::test::SequenceDraw;

constexpr int kEvents = 30;
constexpr Duration kPatience = from_seconds(90.0);
constexpr Duration kToDrive = from_seconds(30.0);
constexpr Duration kProgram = from_seconds(30.0);
constexpr Duration kRepeat = from_milliseconds(200.0);  // of a stop that is not persisted
constexpr Duration kTick = from_milliseconds(50.0);
/// The gateway sets another stop if an operator stops again shortly before a release.
constexpr Duration kQuiet = from_seconds(4.0);
const std::vector<std::string> kIssuers = {"operator", "radio", "tablet"};

struct Totals {
  int events = 0;
  int stops_in_motion = 0;
  int releases = 0;
  int kills = 0;
  int kills_while_stopped = 0;
  int vehicles = 0;
  int driving_after = 0;
  std::vector<double> latencies_ms;
};

/// A vehicle with its judge. Sequences follow one another.
struct Vehicle {
  Vehicle() {
    Bus* const bus = drill.run.bus();
    if (bus == nullptr) return;
    judge = std::make_unique<StopJudge>(kIssuers[0], bus->publisher().boot_id);
    for (const char* channel : {channel::kBgCommand, channel::kBgStop}) {
      commands.emplace_back(bus, channel, [this](const command_t& m, Stamp arrival) {
        if (remember) remember(m);
        judge->take(m, arrival);
      });
    }
    drives.emplace_back(bus, channel::kBgDrive,
                        [this](const drive_t& m, Stamp arrival) { judge->take(m, arrival); });
    statuses.emplace_back(bus, channel::kBgStatus, [this](const status_t& m, Stamp arrival) {
      status = m;
      judge->take(m, arrival);
    });
    truths.emplace_back(bus, channel::kSimTruth,
                        [this](const truth_t& m, Stamp) { judge->take(m); });
    command_out = std::make_unique<Outbox<command_t>>(bus, channel::kBgCommand);
    stop_out = std::make_unique<Outbox<command_t>>(bus, channel::kBgStop);
  }
  [[nodiscard]] bool good() const {
    return drill.run.trouble().empty() && judge && judge->breaches().empty() &&
           drill.safety.metrics().collisions == 0;
  }
  bool drives_within(Duration most) {
    drill.recovery.reset();
    return drill.run_until_well(most);
  }

  LiveFault drill;
  std::unique_ptr<StopJudge> judge;
  std::function<void(const command_t&)> remember;
  status_t status{};
  std::unique_ptr<Outbox<command_t>> command_out, stop_out;
  std::deque<Tap<command_t>> commands;
  std::deque<Tap<drive_t>> drives;
  std::deque<Tap<status_t>> statuses;
  std::deque<Tap<truth_t>> truths;
};

class Sequence {
 public:
  Sequence(unsigned seed, Vehicle* vehicle, Totals* totals)
      : draw_(seed, kIssuers,
              [this](std::int8_t kind, const std::string& issuer) { return issue(kind, issuer); }),
        vehicle_(vehicle),
        run_(&vehicle->drill.run),
        totals_(totals) {
    vehicle_->remember = [this](const command_t& m) { draw_.remember(m); };
  }
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;
  ~Sequence() { vehicle_->remember = {}; }

  void run() {
    const int stops = vehicle_->judge->stops_in_motion();
    const int releases = vehicle_->judge->law().releases();
    for (int k = 0; k < kEvents && vehicle_->good(); ++k) {
      pump(from_milliseconds(50.0 + 10.0 * draw_.below(90)));
      switch (draw_.below(8)) {
        case 0:
          use_program();
          break;
        case 1:
          kill_one();
          break;
        case 2:
          release_all();
          break;
        default:
          happen();
      }
      ++totals_->events;
    }
    end();
    totals_->stops_in_motion += vehicle_->judge->stops_in_motion() - stops;
    totals_->releases += vehicle_->judge->law().releases() - releases;
  }
  /// What happened, for a failure.
  [[nodiscard]] std::string text() const {
    std::string all;
    for (const std::string& line : trace_) all += "  " + line + "\n";
    return all;
  }

 private:
  struct Repeated {
    command_t stop;
    Stamp last;
  };

  void note(const std::string& what) {
    trace_.push_back(fmt::format("{:.3f} {:.2f} m/s, {} stops: {}",
                                 1e-6 * double(to_utime(run_->now())), vehicle_->judge->speed_mps(),
                                 vehicle_->judge->law().in_force().size(), what));
  }

  command_t issue(std::int8_t kind, const std::string& issuer) {
    command_t m{};
    m.issuer = issuer;
    m.boot_id = run_->bus()->publisher().boot_id;
    m.kind = kind;
    m.utime = m.serial = to_utime(run_->now());
    m.valid_until_utime = m.utime + 2'500'000;
    if (kind == command_t::KIND_RELEASE) {
      for (const stop_t& s : vehicle_->status.stop) m.stop_id.push_back(s.id);
    }
    m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
    m.n = 1;
    m.waypoint.resize(1);
    const Vec2& to = course_world()[vehicle_->drill.counts.next_waypoint()];
    m.waypoint[0].p_m[0] = to.x();
    m.waypoint[0].p_m[1] = to.y();
    m.waypoint[0].radius_m = kRadius_m;
    m.waypoint[0].speed_mps = kMaxSpeed_mps;
    return m;
  }

  void send(command_t m) {
    const bool on_stop_channel = m.kind == command_t::KIND_EMERGENCY_STOP && draw_.below(4) > 0;
    (on_stop_channel ? vehicle_->stop_out : vehicle_->command_out)->publish(&m);
  }

  /// Messages are delivered; a superior repeats its stop until BG lists it as persisted.
  void pump(Duration time) {
    const Stamp until = run_->now() + time;
    while (run_->now() < until && run_->trouble().empty()) {
      (void)run_->run_until(std::min(until, run_->now() + kTick), {});
      const bg::test::StopLaw& law = vehicle_->judge->law();
      for (auto r = repeated_.begin(); r != repeated_.end();) {
        const std::int64_t id = r->stop.stop_id.empty() ? 0 : r->stop.stop_id[0];
        const auto stop = law.in_force().find(id);
        if (law.released(id) || (stop != law.in_force().end() && stop->second.persisted)) {
          r = repeated_.erase(r);
          continue;
        }
        if (run_->now() - r->last >= kRepeat) {
          r->last = run_->now();
          send(r->stop);
        }
        ++r;
      }
    }
  }

  void happen() {
    const DrawnEvent e = draw_.draw(vehicle_->judge->law().in_force().size());
    if (e.kind == DrawnEvent::Kind::kKill) return kill_one();
    if (e.kind != DrawnEvent::Kind::kSend) return;
    note(e.what);
    const bool replayed = e.what.find("replayed") != std::string::npos;
    if (e.command.kind == command_t::KIND_EMERGENCY_STOP && !e.command.stop_id.empty() &&
        !replayed) {
      repeated_.push_back({e.command, run_->now()});
    }
    send(e.command);
  }

  void kill_one() {
    ++totals_->kills;
    if (vehicle_->judge->stopped()) ++totals_->kills_while_stopped;
    const auto k = static_cast<std::size_t>(draw_.below(static_cast<int>(2 * kNodes.size() + 1)));
    if (k == 2 * kNodes.size()) {
      note("kill -9 and restart of rcs up");
      return run_->restart_up();
    }
    const std::string& node = kNodes[k % kNodes.size()];
    note("kill -9 of " + node);
    run_->send_signal(node, SIGKILL);  // `rcs up` starts it again
  }

  void use_program() {
    // An id that is greater than those of former sequences.
    const std::string id = std::to_string(to_utime(run_->now()));
    const auto dds = [&](const char* who, const char* what) {
      note(fmt::format("{} of {} over DDS", what, who));
      over_dds_ = true;
      (void)run_->run_program("dds_client", {"-v", "demo3", "-o", who, what, id, "1"}, kProgram);
    };
    switch (draw_.below(5)) {
      case 0:
        note("rcs go --emergency-stop");
        (void)run_->run_program("rcs", {"go", "--emergency-stop", "--timeout", "20"}, kProgram);
        break;
      case 1:
        note("rcs go --release");
        (void)run_->run_program("rcs", {"go", "--release", "--timeout", "20"}, kProgram);
        break;
      case 2:
        dds("alice", "stop");
        break;
      case 3:
        dds("alice", "release");
        break;
      default:
        dds("bob", "release");
    }
  }

  /// By an authority; at rest the vehicle drives on.
  void release_all() {
    note("release of all");
    send(issue(command_t::KIND_RELEASE, kIssuers[0]));
  }

  /// Until no stop is in force.
  void end() {
    const Stamp until = run_->now() + kPatience;
    Stamp latched = run_->now();
    const Duration quiet = over_dds_ ? kQuiet : from_seconds(1.0);
    while (vehicle_->good() && run_->now() - latched < quiet) {
      pump(from_seconds(0.5));
      if (!vehicle_->judge->stopped() && vehicle_->status.stop.empty() && repeated_.empty()) {
        continue;
      }
      latched = run_->now();
      if (latched > until) {
        ADD_FAILURE() << "a stop cannot be released: " << vehicle_->status.reason;
        return;
      }
      release_all();
    }
  }

  SequenceDraw draw_;
  Vehicle* vehicle_;
  VehicleRun* run_;
  Totals* totals_;
  std::deque<std::string> trace_;
  std::vector<Repeated> repeated_;
  bool over_dds_ = false;
};

std::string lines(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& t : texts) all += "  " + t + "\n";
  return all;
}

TEST(StopSequences, NoMotionBeforeTheReleaseOfEveryStop) {
  VehicleRun::use_loopback();
  const int times = number_from("RCS_DRILL_TIMES", 60);
  const int first = number_from("RCS_SEQUENCE_SEED", 1);
  std::unique_ptr<Vehicle> vehicle;
  Totals totals;
  int kept = 0;
  for (int k = 0; k < times; ++k) {
    if (!vehicle) {
      vehicle = std::make_unique<Vehicle>();
      ++totals.vehicles;
      ASSERT_NE(vehicle->judge, nullptr) << vehicle->drill.run.trouble();
      ASSERT_TRUE(vehicle->drives_within(kPatience)) << vehicle->drill.recovery.missing();
    }
    const auto seed = static_cast<unsigned>(first + k);
    Sequence sequence(seed, vehicle.get(), &totals);
    sequence.run();
    const std::vector<double>& ms = vehicle->judge->latencies_ms();
    EXPECT_TRUE(vehicle->good()) << "seed " << seed << ": " << vehicle->drill.run.trouble() << "\n"
                                 << lines(vehicle->judge->breaches()) << vehicle->drill.breaches()
                                 << sequence.text();
    kept += vehicle->good() ? 1 : 0;
    // The planner may find no path from where the vehicle was stopped: not caused by the stop.
    const bool drives = vehicle->good() && vehicle->drives_within(kToDrive);
    totals.driving_after += drives ? 1 : 0;
    const std::string why = drives ? "drives" : "not driving: " + vehicle->drill.recovery.missing();
    EXPECT_NE(why, "not driving: BG is EMERGENCY_STOP") << "seed " << seed << "\n"
                                                        << sequence.text();
    std::fprintf(stderr, "seed %u: %d stops in motion, %d kills, then %s\n", seed,
                 totals.stops_in_motion, totals.kills, why.c_str());
    if (drives && k + 1 < times) continue;
    totals.latencies_ms.insert(totals.latencies_ms.end(), ms.begin(), ms.end());
    vehicle.reset();
  }
  const tools::Summary s = tools::summarize(totals.latencies_ms);
  std::printf(
      "StopSequences: %d of %d: no motion before the release\n%d events with %d vehicles: %d stops "
      "in motion, %d "
      "releases, %d kills, %d of them while stopped; %d sequences ended driving\n%d stops to full "
      "brake: p50 %.1f ms, p99 %.1f ms, max %.1f ms\n",
      kept, times, totals.events, totals.vehicles, totals.stops_in_motion, totals.releases,
      totals.kills, totals.kills_while_stopped, totals.driving_after,
      static_cast<int>(totals.latencies_ms.size()), s.p50, s.p99, s.max);
  EXPECT_GE(totals.stops_in_motion, times / 2);
  EXPECT_GE(totals.releases, times);
}

}  // namespace
}  // namespace rcs::live_faults
