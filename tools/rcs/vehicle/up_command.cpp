// rcs up

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <set>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/base/printable.h"
#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/params/params.h"
#include "rcs/node/process/checkpoint_memory.h"
#include "rcs/node/process/process.h"
#include "rcs/node/process/terminal_line.h"
#include "rcs/node/report.h"
#include "rcs/node/stop_file.h"
#include "rcs/node/stop_latch.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/child_process.h"

#include "tools/rcs/vehicle/run_lock.h"
#include "tools/rcs/vehicle/sensor_watch.h"
#include "tools/rcs/vehicle/service_manager.h"
#include "tools/rcs/vehicle/supervisor.h"
#include "tools/rcs/vehicle/up_recorder.h"
#include "tools/rcs/vehicle/up_report.h"
#include "tools/recorder/recorder_report.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kUpName = "up";
constexpr std::string_view kPrefix = "rcs up: ";
constexpr std::size_t kLastLines = 8;
/// Nodes send a heartbeat once per second: a running node is detected in this time.
constexpr Duration kListen = from_seconds(1.6);
/// Of processes that publish under the name of a node: a flood of ever new ones is cut off.
constexpr std::size_t kStrangers = 16;
/// Maximum number of messages delivered in a row.
constexpr int kMaxMessages = 1000;
/// Of each channel: every message is read before the next one is delivered.
constexpr std::size_t kWaiting = 4;

/// One node: its process, if running, and its heartbeat.
struct Watched {
  Watched(Bus* bus, const std::string& n, ProcessCommand c)
      : name(n),
        command(std::move(c)),
        prefix("[" + n + "] "),
        alive(bus, channel_of(n, "PROCESS"), kWaiting),
        accounts(bus, channel_of(n, "CYCLE"), kWaiting) {}

  std::string name;
  ProcessCommand command;
  std::string prefix;
  Inbox<process_t> alive;
  Inbox<cycle_t> accounts;
  std::optional<ChildProcess> process;
  std::deque<std::string> last_lines;
  std::string last_end;     ///< "ended with status 1"
  std::set<int> pids;       ///< processes started here
  std::set<int> strangers;  ///< other processes that publish under its name, at most kStrangers
};

/// A text from the bus as it is printed on a terminal.
std::string shown(std::string_view text) { return printable_line(text.substr(0, 200)); }

/// Waits for readable data or until `until`.
void wait(std::vector<pollfd>* polled, Stamp until, Stamp now) {
  int timeout_ms = -1;
  if (until <= now) {
    timeout_ms = 0;
  } else if (until != Stamp::max()) {
    // Rounded up, so that the time has passed when poll() returns.
    timeout_ms = static_cast<int>(std::min(milliseconds(until - now), 1e6)) + 1;
  }
  (void)poll(polled->data(), polled->size(), timeout_ms);
}

class Up final : public Command {
 public:
  explicit Up(CLI::App* rcs)
      : Command(rcs->add_subcommand("up", "Start the nodes of the vehicle and keep them running")) {
    app()
        ->add_option("CONFIG", config_, "the vehicle's configuration (TOML)")
        ->type_name("FILE")
        ->required();
    add_bus_option(app(), &lcm_url_);
    CLI::Option* check = app()->add_flag(
        "--check", check_,
        "only check CONFIG with each node; start and create nothing. Status 1 if it is invalid");
    app()->add_flag("--json", json_, "print the result of --check as JSON")->needs(check);
    app()->add_flag("--force", force_, "start even if nodes of these names run on the bus");
    app()
        ->add_option(
            "--record", record_to_,
            "also record all channels, as `rcs record` does; default: folder recordings in the "
            "state directory. CONFIG comes first")
        ->expected(0, 1)
        ->type_name("[FOLDER]")
        ->excludes(check);
    app()->footer(
        "Nodes: [up] nodes in CONFIG (default sp, wm); their programs are next to rcs or in PATH.\n"
        "A node that ends is restarted after 0.2 s, 0.4 s, ... 10 s; a node that is silent for 5 "
        "s\n"
        "is killed first. A node that ends three times in a row within 30 s of its start raises "
        "an\n"
        "alarm (event node.failing, note in `rcs top`); the others keep running. No node starts\n"
        "(status 3) if a critical node rejects CONFIG or cannot start; [up] non_critical in "
        "CONFIG\n"
        "(default gateway, ros2_bridge) names the nodes that are not critical.\n"
        "Ctrl-C or SIGTERM stops all nodes (status 0). The nodes always end with this program.\n"
        "A sensor from which the nodes have received nothing is reported with its channel.\n"
        "The recorder of --record is not critical: its end is an alarm (event recorder.ended) and\n"
        "it is restarted; the nodes keep running.\n"
        "An emergency stop is latched in [process] state_directory (default $STATE_DIRECTORY,\n"
        "$XDG_STATE_HOME/rcs, ~/.local/state/rcs), survives restarts, and is reported at the\n"
        "start; `rcs go --release` ends it when the vehicle is at rest.\n"
        "Examples:\n"
        "  rcs up config/demo3.toml\n"
        "  rcs up config/demo3.toml --record recording/\n"
        "  rcs up --check config/my_vehicle.toml && systemctl restart rcs");
  }

  int run() override;

 private:
  [[nodiscard]] Outcome check(const std::string& name, const StopSignals& stop);
  [[nodiscard]] Outcome check_all(const ProcessTables& tables, const StopSignals& stop);
  /// Prints the result of --check. @return exit status
  [[nodiscard]] int print_check(const std::vector<std::string>& nodes, const Outcome& good) const;
  [[nodiscard]] Outcome report_latched_stop(const ParamFile& file);
  [[nodiscard]] Outcome examine_latch(const ParamFile& file);
  [[nodiscard]] Outcome keep_copy(const ParamFile& params);
  [[nodiscard]] Outcome make_checkpoint(const ParamFile& params);
  [[nodiscard]] Outcome add_processes(const ParamFile& file, const ProcessTables& tables);
  [[nodiscard]] bool is_recorder(const Watched& process) const {
    return records_ && &process == &nodes_.back();
  }
  [[nodiscard]] Outcome refuse_if_alive(LiveTimeline* timeline);
  [[nodiscard]] Outcome watch(const StopSignals& stop, const LiveTimeline& timeline);

  void deliver(Stamp now);
  void read_heartbeats(std::size_t i, Stamp now);
  void carry_out(const SupervisorAction& action, Stamp now);
  void start(std::size_t i, Stamp now);
  void look_for_end(std::size_t i, Stamp now);
  void ended(std::size_t i, const Exit& exit, Stamp now);
  void take_output(Watched* node);
  [[nodiscard]] std::string failure_of(std::size_t i) const;
  void publish(Stamp now);
  void print(const std::string& text) { console_.print(kPrefix, text); }

  std::string config_;
  std::string lcm_url_;
  std::string record_to_;  ///< folder; empty: the default
  bool records_ = false;
  bool check_ = false;
  bool force_ = false;
  bool json_ = false;

  SupervisorParams limits_;
  FileHandle copy_;        ///< of the configuration, in memory
  std::string copy_path_;  ///< for the nodes, which end with this process
  std::optional<CheckpointOwner> checkpoint_;
  TerminalLines console_;
  std::unique_ptr<LcmBus> bus_;
  std::deque<Watched> nodes_;  // and, last, the recorder; deque: the bus holds their addresses
  std::optional<Supervisor> supervisor_;
  std::optional<UpReport> report_;
  std::optional<SensorWatch> sensors_;
};

int Up::run() {
  config_ = command_line::find_config(config_);
  const Result<ParamFile> params = ParamFile::load(config_);
  // As `rcs config check`: a file that can be read and is not valid is a negative result.
  if (!params) {
    const bool readable = check_ && tools::read_text(config_);
    return readable ? print_check({}, params.error()) : fail(kUpName, params.error());
  }
  const Result<ProcessTables> tables = read_process_tables(*params);
  if (!tables) {
    return check_ ? print_check({}, tables.error()) : fail(kUpName, tables.error());
  }
  const std::vector<std::string>& nodes = tables->nodes;
  for (const auto& [name, realtime] : tables->realtime) {
    if (std::find(nodes.begin(), nodes.end(), name) == nodes.end()) {
      print(
          fmt::format("{}: [process.{}] is not the table of a node in [up] nodes", config_, name));
    }
  }

  const StopSignals stop;
  Outcome good = check_all(*tables, stop);
  if (good && std::find(nodes.begin(), nodes.end(), "bg") != nodes.end()) {
    good = check_ ? examine_latch(*params) : report_latched_stop(*params);
  }
  if (check_) return print_check(nodes, good);
  if (!good) return fail(kUpName, good.error());
  // A reader of the messages may end (`rcs up ... | head`): the vehicle goes on.
  (void)std::signal(SIGPIPE, SIG_IGN);

  if (Outcome kept = keep_copy(*params); !kept) return fail(kUpName, kept.error());
  Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(lcm_url_);
  if (!opened) return fail(kUpName, opened.error());
  const Result<RunLock> lock = RunLock::take((*opened)->url());
  if (!lock) return fail(kUpName, lock.error());
  Publisher publisher = (*opened)->publisher();
  publisher.run_id = random_id();
  (*opened)->set_publisher(publisher);
  const std::string run = std::to_string((*opened)->publisher().run_id);
  (void)setenv(kRunIdVariable, run.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread yet
  if (const Outcome made = make_checkpoint(*params); !made) return fail(kUpName, made.error());
  bus_ = std::move(opened).value();
  if (const Outcome added = add_processes(*params, *tables); !added) {
    return fail(kUpName, added.error());
  }
  LiveTimeline timeline(bus_.get(), &stop);
  if (!force_) {
    if (const Outcome alone = refuse_if_alive(&timeline); !alone) {
      return fail(kUpName, alone.error());
    }
  }
  report_.emplace(bus_.get(), config_, params->text_id(), timeline.now());
  sensors_.emplace(timeline.now(), std::find(nodes.begin(), nodes.end(), "sp") != nodes.end());
  notify_service_manager("READY=1");
  const Outcome done = watch(stop, timeline);
  if (!done) return fail(kUpName, done.error());
  print("all stopped");
  return kExitOk;
}

int Up::print_check(const std::vector<std::string>& nodes, const Outcome& good) const {
  if (json_) {
    fmt::print("{}",
               report::json_document(kUpName, {{"config", config_},
                                               {"nodes", nodes},
                                               {"valid", good.ok()},
                                               {"reason", good ? "" : good.error().message}}));
    return good ? kExitOk : kExitNegative;
  }
  if (!good) return negative(kUpName, good.error());
  fmt::print("rcs up: {} is valid for its {} nodes\n", config_, nodes.size());
  return kExitOk;
}

Outcome Up::add_processes(const ParamFile& file, const ProcessTables& tables) {
  std::vector<bool> critical;
  for (const std::string& name : tables.nodes) {
    nodes_.emplace_back(
        bus_.get(), name,
        ProcessCommand{name, {config_, "--copy", copy_path_, "--lcm-url", bus_->url()}});
    critical.push_back(tables.is_critical(name));
  }
  records_ = app()->count("--record") > 0;
  if (records_) {
    Result<ProcessCommand> command = recorder_command(record_to_, file, bus_->url());
    if (!command) return command.error();
    nodes_.emplace_back(bus_.get(), std::string(recorder::kNodeName), std::move(command).value());
    critical.push_back(false);
  }
  supervisor_.emplace(critical, limits_);
  return Done{};
}

/// Checks all nodes, so that all problems are reported at once.
/// @return an error if no node is to be started
Outcome Up::check_all(const ProcessTables& tables, const StopSignals& stop) {
  std::string refused;
  for (const std::string& name : tables.nodes) {
    const Outcome good = check(name, stop);
    if (good) continue;
    if (check_ || tables.is_critical(name)) {
      refused += (refused.empty() ? "" : "\n") + good.error().message;
    } else {
      print(good.error().message);
      print(fmt::format("{} is not critical: the other nodes start without it", name));
    }
  }
  return refused.empty() ? Outcome(Done{}) : Outcome(Error{refused});
}

/// The program of the node checks the configuration, because only the node knows its requirements.
Outcome Up::check(const std::string& name, const StopSignals& stop) {
  const Result<std::string> program = find_program(name);
  if (!program) return program.error();
  Result<ChildProcess> started = ChildProcess::start(*program, {config_, "--check"});
  if (!started) return started.error();
  ChildProcess& process = started.value();
  std::string output;
  for (;;) {
    std::vector<pollfd> polled = {{process.exit_fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}};
    if (process.output_fd() >= 0) polled.push_back({process.output_fd(), POLLIN, 0});
    wait(&polled, Stamp::max(), Stamp());
    if (polled[1].revents != 0) {
      note_interrupt();
      return Error{"interrupted"};  // the child ends with this process
    }
    process.read_output([&](std::string_view line) { output.append("\n  ").append(line); });
    if (const std::optional<Exit> exit = process.collect()) {
      process.read_output([&](std::string_view line) { output.append("\n  ").append(line); });
      if (!exit->by_signal && exit->code == 0) return Done{};
      return Error{fmt::format("{} {} --check {}:{}", name, config_, to_text(*exit), output)};
    }
  }
}

/// BG latches emergency stops in a file that it reads at its start.
Outcome Up::report_latched_stop(const ParamFile& file) {
  const Result<StopLatch> latch = open_stop_latch(file);
  if (!latch) return latch.error();
  if (latch->engaged()) {
    print(
        fmt::format("an emergency stop is latched ({}; {}): the vehicle does not move until it is "
                    "released at rest: rcs go --release",
                    latch->cause(), latch->path()));
  }
  return Done{};
}

/// For --check: it creates nothing, and another user than that of the vehicle may run it.
Outcome Up::examine_latch(const ParamFile& file) {
  const Result<std::string> path = stop_latch_path(file);
  if (!path) return path.error();
  if (const Outcome writable = examine_stop_folder(*path); !writable) {
    print(
        fmt::format("note: {}. Emergency stops are latched there: the user that runs the vehicle "
                    "(`rcs up`, or User= of rcs.service) must be able to write to it",
                    writable.error().message));
    return Done{};
  }
  if (!read_stop_file(*path).stops.empty()) {
    print(fmt::format("note: an emergency stop is latched ({})", *path));
  }
  return Done{};
}

/// A node that is restarted reads what the others have read, whatever happens to the file.
Outcome Up::keep_copy(const ParamFile& params) {
  copy_ = FileHandle(memfd_create("rcs configuration", MFD_CLOEXEC));
  const std::string& text = params.text();
  const bool kept = copy_.valid() && write(copy_.get(), text.data(), text.size()) ==
                                         static_cast<ssize_t>(text.size());
  if (!kept) return Error{fmt::format("cannot copy {}: {}", config_, std::strerror(errno))};
  copy_path_ = fmt::format("/proc/{}/fd/{}", getpid(), copy_.get());
  return Done{};
}

/// The terrain around a vehicle at rest outlives this process. Without, every start knows as little
/// as the first one.
Outcome Up::make_checkpoint(const ParamFile& params) {
  const Result<std::string> vehicle = stop_latch_path(params);
  Result<CheckpointOwner> memory = vehicle ? CheckpointOwner::open(checkpoint_folder(), *vehicle)
                                           : Result<CheckpointOwner>(vehicle.error());
  if (!memory) {
    print(fmt::format("{}: a later `rcs up` will not know the terrain", memory.error().message));
    memory = CheckpointOwner::create();
    if (!memory) return memory.error();
  }
  checkpoint_ = std::move(memory).value();
  (void)setenv(kCheckpointVariable, checkpoint_->path().c_str(),
               1);  // NOLINT(concurrency-mt-unsafe): one thread yet
  return Done{};
}

Outcome Up::refuse_if_alive(LiveTimeline* timeline) {
  const Stamp until = timeline->now() + kListen;
  for (;;) {
    const Timeline::Step step = timeline->advance(until);
    if (step == Timeline::Step::kEnded) {
      if (Outcome status = bus_->status(); !status) return status;
      note_interrupt();
      return Error{"interrupted"};
    }
    for (Watched& node : nodes_) {
      if (is_recorder(node)) continue;  // two recorders do not disturb each other
      if (const process_t* seen = node.alive.latest()) {
        return Error{fmt::format(
            "{} is already alive on {}: process {}, configuration {}. Two nodes of one name would "
            "both publish. Stop that one first (or use --force).",
            node.name, bus_->url(), seen->pid, shown(seen->config))};
      }
    }
    if (step == Timeline::Step::kReached) return Done{};
  }
}

Outcome Up::watch(const StopSignals& stop, const LiveTimeline& timeline) {
  std::vector<pollfd> polled;
  while (!supervisor_->finished()) {
    // Pending messages are delivered before silence is judged: this process may have been delayed.
    deliver(timeline.now());
    const Stamp now = timeline.now();
    for (const SupervisorAction& action : supervisor_->due(now)) carry_out(action, now);
    publish(now);
    if (!supervisor_->stopping()) {
      for (const std::string& line : sensors_->due(now)) print(line);
    }

    polled = {{bus_->fd(), POLLIN, 0}};
    if (!supervisor_->stopping()) polled.push_back({stop.fd(), POLLIN, 0});
    for (const Watched& node : nodes_) {
      if (!node.process) continue;
      polled.push_back({node.process->exit_fd(), POLLIN, 0});
      if (node.process->output_fd() >= 0) polled.push_back({node.process->output_fd(), POLLIN, 0});
    }
    wait(&polled, std::min(supervisor_->next(), report_->next()), timeline.now());

    if (!supervisor_->stopping() && polled[1].revents != 0) {
      print("stopping");
      notify_service_manager("STOPPING=1");
      supervisor_->stop();
    }
    if (!bus_->status()) supervisor_->stop();
    for (std::size_t i = 0; i < nodes_.size(); ++i) look_for_end(i, timeline.now());
  }
  if (const std::optional<std::size_t> culprit = supervisor_->gave_up_on()) {
    const Watched& node = nodes_[*culprit];
    std::string text = fmt::format("{} does not start; its last lines:", node.name);
    for (const std::string& line : node.last_lines) text += "\n  " + line;
    return Error{text};
  }
  return bus_->status();
}

void Up::deliver(Stamp now) {
  // Each is read at once: no number of messages of others displaces a heartbeat.
  for (int k = 0; k < kMaxMessages && bus_->deliver_one(now); ++k) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) read_heartbeats(i, now);
  }
}

void Up::read_heartbeats(std::size_t i, Stamp now) {
  Watched& node = nodes_[i];
  for (; const cycle_t* account = node.accounts.front(); node.accounts.pop()) {
    sensors_->on_cycle(*account);
  }
  for (; const process_t* seen = node.alive.front(); node.alive.pop()) {
    if (node.process && seen->pid == node.process->pid()) {
      const bool was_failing = supervisor_->failing(i);
      supervisor_->on_alive(i, now);
      if (was_failing && !supervisor_->failing(i)) report_->recovered(now, node.name);
    } else if (node.pids.count(seen->pid) == 0 && node.strangers.size() < kStrangers &&
               node.strangers.insert(seen->pid).second) {
      print(
          fmt::format("another {} publishes on this bus: process {}, publisher {}, "
                      "configuration {}{}",
                      node.name, seen->pid, id_text(seen->publisher_id), shown(seen->config),
                      node.strangers.size() == kStrangers ? "; further ones are not named" : ""));
    }
  }
}

void Up::carry_out(const SupervisorAction& action, Stamp now) {
  Watched& node = nodes_[action.node];
  switch (action.kind) {
    case SupervisorAction::Kind::kStart:
      return start(action.node, now);
    case SupervisorAction::Kind::kTerminate:
      return node.process->send_signal(SIGTERM);
    case SupervisorAction::Kind::kKillSilent:
      print(fmt::format("{} hangs: nothing on {} for {:.0f} s; killed", node.name,
                        node.alive.channel(), seconds(limits_.silent_for)));
      break;
    case SupervisorAction::Kind::kKillUnstarted:
      print(fmt::format("{} is not up: nothing on {} within {:.0f} s of its start; killed",
                        node.name, node.alive.channel(), seconds(limits_.start_within)));
      break;
    case SupervisorAction::Kind::kKillUnstopped:
      print(fmt::format("{} does not stop; killed", node.name));
      break;
  }
  node.process->send_signal(SIGKILL);
}

void Up::start(std::size_t i, Stamp now) {
  Watched& node = nodes_[i];
  const Result<std::string> program = find_program(node.command.program);
  Result<ChildProcess> started = program ? ChildProcess::start(*program, node.command.arguments)
                                         : Result<ChildProcess>(program.error());
  if (!started) {
    print(started.error().message);
    // As in a shell for a program that cannot be executed.
    return ended(i, {false, 127}, now);
  }
  node.process.emplace(std::move(started).value());
  node.pids.insert(node.process->pid());
  print(fmt::format("{} started: process {}", node.name, node.process->pid()));
}

void Up::look_for_end(std::size_t i, Stamp now) {
  Watched& node = nodes_[i];
  if (!node.process) return;
  take_output(&node);
  const std::optional<Exit> exit = node.process->collect();
  if (!exit) return;
  take_output(&node);  // the output before the end
  node.process.reset();
  ended(i, *exit, now);
}

void Up::ended(std::size_t i, const Exit& exit, Stamp now) {
  const bool was_failing = supervisor_->failing(i);
  nodes_[i].last_end = to_text(exit);
  const std::optional<Duration> restart = supervisor_->on_exit(i, exit, now);
  print(fmt::format("{} {}{}", nodes_[i].name, nodes_[i].last_end,
                    restart ? fmt::format("; restart in {:.1f} s", seconds(*restart)) : ""));
  if (restart && is_recorder(nodes_[i])) {
    print("ALARM: messages are not recorded until the recorder runs again");
    report_->recorder_ended(now, nodes_[i].last_end);
  }
  if (!restart || was_failing || !supervisor_->failing(i)) return;
  print("ALARM: " + failure_of(i) + "; the other nodes keep running");
  report_->failing(now, failure_of(i) + "; the other nodes keep running");
}

std::string Up::failure_of(std::size_t i) const {
  return fmt::format(
      "{} fails repeatedly: at least {} times in a row, last it {}; restarted at least every "
      "{:.0f} s",
      nodes_[i].name, limits_.failing_after, nodes_[i].last_end, seconds(limits_.longest_backoff));
}

void Up::publish(Stamp now) {
  std::string note;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (supervisor_->failing(i)) note += (note.empty() ? "" : "; ") + failure_of(i);
  }
  if (!report_->process(now, note)) return;
  notify_service_manager("WATCHDOG=1");
  checkpoint_->keep();
}

void Up::take_output(Watched* node) {
  node->process->read_output([&](std::string_view line) {
    console_.print(node->prefix, line);
    node->last_lines.emplace_back(line);
    if (node->last_lines.size() > kLastLines) node->last_lines.pop_front();
  });
}

}  // namespace

void add_up_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Up>(rcs));
}

}  // namespace rcs::cli
