#include "tools/rcs/vehicle/budget_run.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <thread>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/log/log_source.h"
#include "rcs/node/report.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/budget_operators.h"
#include "tools/rcs/vehicle/child_process.h"

namespace rcs::cli {
namespace {

constexpr std::size_t kLastLines = 12;
constexpr Duration kStartWithin = from_seconds(20.0);  // a loaded computer, a large map
constexpr Duration kTail = from_seconds(1.0);          // for the results of the last scan
constexpr Duration kStopWithin = from_seconds(5.0);
constexpr Duration kLongestScan = from_seconds(1.0);
constexpr Duration kLook = from_seconds(0.1);  // period of the check of the child processes

/// Records every message of a channel for the lap, and counts missed messages.
template <class T>
class LapTap {
 public:
  LapTap(Bus* bus, const std::string& channel, std::function<void(const T&)> take)
      : tap_(bus, channel, [this, take = std::move(take)](const T& m, Stamp /*arrival*/) {
          if (last_seq_ > 0 && m.seq > last_seq_ + 1) missed_ += m.seq - last_seq_ - 1;
          last_seq_ = m.seq;
          take(m);
        }) {}
  [[nodiscard]] std::int64_t missed() const { return missed_; }

 private:
  std::int64_t last_seq_ = 0;  // a restarted node counts from 1
  std::int64_t missed_ = 0;
  Tap<T> tap_;
};

/// The process of a node and the source of its latest messages.
struct Running {
  std::string name;
  ChildProcess process;
  bool alive = false;
  std::optional<Exit> exit;
};

class Laps {
 public:
  Laps(const BudgetPlan& plan, LcmBus* bus, LiveTimeline* timeline,
       std::function<void(double)> progress);

  Outcome run();
  [[nodiscard]] BudgetRun take_result() { return std::move(result_); }
  /// Ends all processes; none outlives the command.
  void stop_all();

 private:
  Outcome start_load();
  Outcome start_nodes();
  Outcome play();
  bool decode_facet(const SourceEvent& event);
  void send(const SourceEvent& event);
  Outcome wait_until(Stamp until, const std::function<bool()>& enough);
  Outcome look();
  void read_output(Running* node);
  void stop(std::vector<Running>* processes);

  BudgetPlan plan_;
  LcmBus* bus_;
  LiveTimeline* timeline_;
  std::function<void(double)> progress_;
  BudgetRun result_;
  Duration lap_{};  // time within the current lap
  evaluation::ScanLatencyTrace trace_;
  std::vector<Running> nodes_;
  std::vector<Running> load_;
  std::deque<std::string> said_;
  Stamp next_look_ = Stamp::min();
  ladar_ranges_t ranges_{};
  ladar_points_t points_{};
  std::int64_t scan_ = -1;        // reference instant of the scan in progress
  std::int64_t facet_scan_ = -1;  // reference instant of the scan of the current event

  std::optional<BudgetOperator> operator_;  // if BG is one of the nodes
  std::optional<BudgetMission> mission_;    // instead, if the mission is one of them
  LapTap<registration_t> registrations_;
  LapTap<nav_state_t> nav_states_;
  LapTap<drive_t> drives_;
  std::deque<LapTap<cycle_t>> cycles_;
  std::deque<LapTap<process_t>> lives_;
};

Laps::Laps(const BudgetPlan& plan, LcmBus* bus, LiveTimeline* timeline,
           std::function<void(double)> progress)
    : plan_(plan),
      bus_(bus),
      timeline_(timeline),
      progress_(std::move(progress)),
      registrations_(bus, channel::kSpRegistration,
                     [this](const registration_t& m) { trace_.accept(m); }),
      nav_states_(bus, channel::kWmNavState,
                  [this](const nav_state_t& m) {
                    trace_.accept(m);
                    if (operator_) operator_->take(m);
                    if (mission_) mission_->take(m);
                  }),
      drives_(bus, channel::kBgDrive, [this](const drive_t& m) { trace_.accept(m); }) {
  const auto runs = [this](std::string_view node) {
    return std::find(plan_.nodes.begin(), plan_.nodes.end(), node) != plan_.nodes.end();
  };
  if (runs("mission")) {
    mission_.emplace(bus);
  } else if (runs("bg")) {
    operator_.emplace(bus);
  }
  for (const std::string& node : plan_.nodes) {
    cycles_.emplace_back(bus, channel_of(node, "CYCLE"),
                         [this](const cycle_t& m) { trace_.accept(m); });
    lives_.emplace_back(bus, channel_of(node, "PROCESS"), [this](const process_t& m) {
      for (Running& r : nodes_) r.alive = r.alive || r.process.pid() == m.pid;
    });
  }
}

Outcome Laps::run() {
  if (Outcome started = start_load(); !started) return started;
  while (result_.played < plan_.length && !result_.interrupted) {
    trace_ = {};
    if (Outcome started = start_nodes(); !started) return started;
    Outcome played = play();
    stop(&nodes_);
    if (!played) return played;
    result_.record.add(trace_.close());
  }
  result_.missed_here = registrations_.missed() + nav_states_.missed() + drives_.missed();
  for (const LapTap<cycle_t>& tap : cycles_) result_.missed_here += tap.missed();
  return Done{};
}

void Laps::stop_all() {
  stop(&nodes_);
  stop(&load_);
}

Outcome Laps::start_load() {
  for (const std::string& kind : plan_.load) {
    const unsigned n = kind == "cpu" ? std::max(1U, std::thread::hardware_concurrency()) : 1U;
    for (unsigned i = 0; i < n; ++i) {
      Result<ChildProcess> started = ChildProcess::start("/proc/self/exe", {"load", kind});
      if (!started) return started.error();
      load_.push_back({"load " + kind, std::move(started).value(), false, {}});
    }
  }
  return Done{};
}

Outcome Laps::start_nodes() {
  for (const std::string& name : plan_.nodes) {
    const Result<std::string> program = find_program(name);
    if (!program) return program.error();
    Result<ChildProcess> started =
        ChildProcess::start(*program, {plan_.config, "--lcm-url", bus_->url()});
    if (!started) return started.error();
    nodes_.push_back({name, std::move(started).value(), false, {}});
  }
  const auto all_alive = [this] {
    return std::all_of(nodes_.begin(), nodes_.end(), [](const Running& r) { return r.alive; });
  };
  if (Outcome waited = wait_until(timeline_->now() + kStartWithin, all_alive); !waited) {
    return waited;
  }
  if (result_.interrupted || all_alive()) return Done{};
  return Error{fmt::format("not all nodes were up within {:.0f} s", seconds(kStartWithin))};
}

/// One lap: to the end of the log or of the requested time.
Outcome Laps::play() {
  if (result_.interrupted) return Done{};
  Result<LogReader> reader = LogReader::open(plan_.log);
  if (!reader) return reader.error();
  LogSource source(&reader.value(), {channel::kSensors.begin(), channel::kSensors.end()});
  const Stamp first = source.peek();
  if (first == Stamp::max()) return Error{plan_.log + ": no sensor data"};
  const Stamp begin = timeline_->now() + kLook;
  const Duration left = plan_.length - result_.played;
  SourceEvent event;
  scan_ = -1;
  lap_ = {};
  for (Stamp due = source.peek(); due != Stamp::max(); due = source.peek()) {
    source.take(&event);
    // The scan in progress is sent completely: a partial scan would count as lost.
    const bool begins_scan = decode_facet(event);
    const Duration over = due - first - left;
    if (over > kLongestScan || (over > Duration::zero() && begins_scan)) break;
    const Stamp moment = begin + (due - first);
    if (Outcome waited = wait_until(moment, {}); !waited) return waited;
    if (result_.interrupted) break;
    lap_ = due - first;
    result_.worst_send = std::max(result_.worst_send, timeline_->now() - moment);
    send(event);
  }
  // A lap without duration would be repeated endlessly.
  if (lap_ <= Duration::zero() && !result_.interrupted) {
    return Error{plan_.log + ": no sensor data at different times"};
  }
  result_.played += lap_ + Duration(1);
  lap_ = {};
  if (result_.interrupted) return Done{};
  return wait_until(timeline_->now() + kTail, {});
}

/// Sets `facet_scan_` to the scan of a facet, -1 for other messages. @return true for its first
bool Laps::decode_facet(const SourceEvent& event) {
  const int size = static_cast<int>(event.data.size());
  facet_scan_ = -1;
  if (event.channel == channel::kLadarRanges) {
    if (ranges_.decode(event.data.data(), 0, size) == size) facet_scan_ = ranges_.reference_utime;
  } else if (event.channel == channel::kLadarPoints) {
    if (points_.decode(event.data.data(), 0, size) == size) facet_scan_ = points_.reference_utime;
  }
  if (facet_scan_ < 0 || facet_scan_ == scan_) return false;
  scan_ = facet_scan_;
  return true;
}

void Laps::send(const SourceEvent& event) {
  const Stamp now = timeline_->now();
  bus_->publish(event.channel, event.data.data(), event.data.size());
  if (facet_scan_ >= 0) trace_.sent(facet_scan_, now);
}

/// @param enough  ends waiting early; may be empty
Outcome Laps::wait_until(Stamp until, const std::function<bool()>& enough) {
  for (;;) {
    if (timeline_->now() >= next_look_) {
      next_look_ = timeline_->now() + kLook;
      if (Outcome looked = look(); !looked) return looked;
    }
    if (enough && enough()) return Done{};
    const Timeline::Step step = timeline_->advance(std::min(until, next_look_));
    if (step == Timeline::Step::kEnded) {
      if (Outcome status = bus_->status(); !status) return status;
      result_.interrupted = true;
      note_interrupt();
      return Done{};
    }
    if (step == Timeline::Step::kReached && timeline_->now() >= until) return Done{};
  }
}

/// A node that ends by itself ends the measurement. The output of all nodes is read, because a full
/// pipe would block them.
Outcome Laps::look() {
  if (operator_) operator_->step(timeline_->now());
  if (mission_) mission_->step(timeline_->now());
  progress_(std::min(1.0, seconds(result_.played + lap_) / seconds(plan_.length)));
  for (std::vector<Running>* processes : {&nodes_, &load_}) {
    for (Running& r : *processes) {
      read_output(&r);
      if (!r.exit) r.exit = r.process.collect();
      if (!r.exit) continue;
      read_output(&r);
      std::string text = fmt::format("{} {}; last lines of all nodes:", r.name, to_text(*r.exit));
      for (const std::string& line : said_) text += "\n  " + line;
      return Error{text};
    }
  }
  return Done{};
}

void Laps::read_output(Running* node) {
  node->process.read_output([&](std::string_view line) {
    said_.push_back(fmt::format("[{}] {}", node->name, line));
    if (said_.size() > kLastLines) said_.pop_front();
  });
}

void Laps::stop(std::vector<Running>* processes) {
  for (Running& r : *processes) {
    if (!r.exit) r.process.send_signal(SIGTERM);
  }
  const Stamp until = timeline_->now() + kStopWithin;
  bool killed = false;
  for (;;) {
    bool running = false;
    for (Running& r : *processes) {
      read_output(&r);
      if (!r.exit) r.exit = r.process.collect();
      running = running || !r.exit;
    }
    if (!running) break;
    if (!killed && timeline_->now() >= until) {
      for (Running& r : *processes) {
        if (!r.exit) r.process.send_signal(SIGKILL);
      }
      killed = true;
    }
    // After Ctrl-C the timeline cannot wait any more; the processor is yielded instead.
    if (timeline_->advance(timeline_->now() + kLook / 10) == Timeline::Step::kEnded) {
      std::this_thread::yield();
    }
  }
  processes->clear();
}

}  // namespace

Result<BudgetRun> run_budget(const BudgetPlan& plan, const std::function<void(double)>& progress) {
  const StopSignals stop;
  const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(plan.lcm_url);
  if (!bus) return bus.error();
  LiveTimeline timeline(bus->get(), &stop);
  Laps laps(plan, bus->get(), &timeline, progress);
  const Outcome done = laps.run();
  laps.stop_all();
  if (!done) return done.error();
  return laps.take_result();
}

}  // namespace rcs::cli
