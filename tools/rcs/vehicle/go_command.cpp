// rcs go

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/base/geodesy.h"
#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/command_port.h"
#include "sim/scenario_file.h"
#include "tools/base/random_places.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/operator_session.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kGoName = "go";

class Go final : public Command {
 public:
  explicit Go(CLI::App* rcs)
      : Command(rcs->add_subcommand("go", "Send drive or stop commands to BG")) {
    add_repeated(app(), "--waypoint", &waypoints_,
                 "position of a waypoint in the frame of --frame [m]")
        ->type_name("X,Y");
    app()
        ->add_option("--scenario", scenario_, "use the waypoints and the speed of this scenario")
        ->transform(command_line::config_file());
    app()->add_option("--seed", seed_, "seed of the scenario, instead of its own");
    app()
        ->add_option("--speed", speed_mps_,
                     "speed limit [m/s]; default: 5, or that of the scenario")
        ->check(CLI::Range(0.1, 30.0));
    app()
        ->add_option("--radius", radius_m_, "distance at which a waypoint counts as reached [m]")
        ->check(CLI::Range(0.5, 50.0))
        ->capture_default_str();
    app()
        ->add_option("--frame", frame_, "frame of the waypoints: world (east, north) or local")
        ->check(CLI::IsMember({"world", "local"}))
        ->capture_default_str();
    app()
        ->add_option("--timeout", timeout_s_,
                     "time limit [s] for the arrival or the confirmation of an emergency stop;\n"
                     "when exceeded the vehicle is stopped, status 1; default: no limit")
        ->check(CLI::Range(0.0, 1e6));
    app()
        ->add_option("--patience", patience_s_,
                     "maximum time without a status of BG, or with an error of BG [s]; when\n"
                     "exceeded: status 1, or 3 if no status was received at all")
        ->check(CLI::Range(1.0, 1e6))
        ->capture_default_str();
    app()->add_flag("--halt", halt_, "stop and hold");
    app()->add_flag("--emergency-stop", emergency_stop_,
                    "brake; latched, also across restarts of all nodes, until --release");
    app()->add_flag("--release", release_,
                    "release an emergency stop; the vehicle must be at rest");
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--json", json_, "print the result as JSON");
    app()->footer(
        "The command is repeated every second, and BG stops 2.5 s after the last repetition;\n"
        "therefore this program must keep running. After a restart BG continues with the "
        "waypoints\n"
        "not yet reached. Ctrl-C halts the vehicle first. --emergency-stop is sent until BG\n"
        "confirms that it is latched on disk, or until --timeout. Status 0: arrived, or command\n"
        "echoed (--halt, --emergency-stop, --release); 1: not arrived or rejected, with the "
        "reason\n"
        "of BG; 3: no BG on the bus.\n"
        "Examples:\n"
        "  rcs go --waypoint 40,0 --waypoint 60,30 --speed 4\n"
        "  rcs go --scenario config/sim/closed_loop.toml --seed 3 --timeout 170\n"
        "  rcs go --emergency-stop");
  }

  int run() override {
    if (const std::string wrong = wrong_usage(); !wrong.empty()) {
      fmt::print(stderr, "rcs go: {}\n", wrong);
      return kExitUsage;
    }
    const Result<rcs::Command> command = requested_command();
    if (!command) return fail(kGoName, command.error());
    const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(lcm_url_);
    if (!bus) return fail(kGoName, bus.error());
    OperatorSession session(bus->get(), kBgNode);
    const Stamp begin = session.now();
    const Ending ending = pursue(&session, *command);
    session.end_line();
    if (const Outcome status = (*bus)->status(); !status) return fail(kGoName, status.error());
    const bool no_bg = !ending.good && session.state().empty();
    if (json_ && !no_bg && !was_interrupted()) {
      const report::Json j = {{"command", name_of_kind(command->kind)},
                              {"result", ending.result},
                              {"reason", ending.reason},
                              {"state", session.state()},
                              {"waypoints", command->waypoints.size()},
                              {"time_s", seconds(session.now() - begin)}};
      fmt::print("{}", report::json_document(kGoName, j));
    }
    if (ending.good && !json_) fmt::print("{}\n", effect_of(command->kind));
    if (ending.good) return kExitOk;
    return no_bg ? fail(kGoName, Error{ending.reason}) : negative(kGoName, Error{ending.reason});
  }

 private:
  static std::string_view name_of_kind(std::int8_t kind) {
    switch (kind) {
      case command_t::KIND_GOTO:
        return "goto";
      case command_t::KIND_EMERGENCY_STOP:
        return "emergency_stop";
      case command_t::KIND_RELEASE:
        return "release";
      default:
        return "halt";
    }
  }

  static std::string_view effect_of(std::int8_t kind) {
    switch (kind) {
      case command_t::KIND_GOTO:
        return "arrived";
      case command_t::KIND_EMERGENCY_STOP:
        return "emergency stop latched";
      case command_t::KIND_RELEASE:
        return "release accepted";
      default:
        return "halt accepted";
    }
  }

  [[nodiscard]] std::string wrong_usage() const {
    const int asked = static_cast<int>(!waypoints_.empty()) + static_cast<int>(!scenario_.empty()) +
                      static_cast<int>(halt_) + static_cast<int>(emergency_stop_) +
                      static_cast<int>(release_);
    if (asked != 1) {
      return "exactly one of --waypoint, --scenario, --halt, --emergency-stop and --release is "
             "required";
    }
    if (seed_ && scenario_.empty()) return "--seed requires --scenario";
    if (!scenario_.empty() && frame_ != "world") {
      return "the waypoints of a scenario are in frame world";
    }
    for (const std::string& text : waypoints_) {
      if (!tools::parse_place(text)) return "--waypoint " + text + ": expected X,Y in metres";
    }
    return "";
  }

  [[nodiscard]] Result<rcs::Command> requested_command() {
    rcs::Command command;
    if (halt_ || emergency_stop_ || release_) {
      command.kind = halt_             ? command_t::KIND_HALT
                     : emergency_stop_ ? command_t::KIND_EMERGENCY_STOP
                                       : command_t::KIND_RELEASE;
      return command;
    }
    command.kind = command_t::KIND_GOTO;
    command.frame = frame_ == "local" ? command_t::FRAME_LOCAL : command_t::FRAME_WORLD;
    std::vector<Vec2> places;
    double speed_mps = 5.0;
    for (const std::string& text : waypoints_) places.push_back(*tools::parse_place(text));
    if (!scenario_.empty()) {
      sim::ScenarioOverrides overrides;
      overrides.seed = seed_;
      const Result<sim::Scenario> s = sim::load_scenario(scenario_, overrides);
      if (!s) return s.error();
      places.assign(s->course.waypoints_world.begin() + 1, s->course.waypoints_world.end());
      speed_mps = s->course.speed_mps;
      datum_ = s->datum;
    }
    for (const Vec2& p : places) {
      waypoint_t w{};
      to_message(Vec3(p.x(), p.y(), 0.0), w.p_m);
      w.radius_m = radius_m_;
      w.speed_mps = speed_mps_.value_or(speed_mps);
      command.waypoints.push_back(w);
    }
    return command;
  }

  [[nodiscard]] Duration most() const {
    return timeout_s_ ? from_seconds(*timeout_s_) : Duration::max();
  }

  [[nodiscard]] Ending pursue(OperatorSession* session, const rcs::Command& command) const {
    if (command.kind == command_t::KIND_GOTO) return drive(session, command);
    if (command.kind == command_t::KIND_EMERGENCY_STOP) return session->emergency_stop(most());
    return session->send_once(command);
  }

  [[nodiscard]] Ending drive(OperatorSession* session, rcs::Command command) const {
    if (datum_) into_world_of(session, &command);
    if (was_interrupted()) return {false, "interrupted", "interrupted"};  // nothing was sent
    Ending ending = session->pursue(command, most(), from_seconds(patience_s_));
    if (ending.result != "interrupted" && ending.result != "timeout") return ending;
    session->end_line();
    const Ending halted = session->send_once({});
    ending.reason +=
        halted.good ? "; BG halts" : "; BG does not confirm the halt: " + halted.reason;
    return ending;
  }

  /// The datum of WM may differ from that of the scenario. Waypoints are converted once the datum
  /// of WM is known; until then they are shifted by the error of the first fix.
  void into_world_of(OperatorSession* session, rcs::Command* command) const {
    const nav_state_t* const belief = session->belief();
    if (belief == nullptr) {
      fmt::print(stderr,
                 "rcs go: WM has no world pose yet: assuming that its datum is that of the "
                 "scenario\n");
      return;
    }
    const Pose T_wm_scenario = LocalFrame({radians(belief->datum_lat_deg),
                                           radians(belief->datum_lon_deg),
                                           {belief->datum_height_m}})
                                   .from(LocalFrame(*datum_));
    for (waypoint_t& w : command->waypoints) to_message(T_wm_scenario * from_message(w.p_m), w.p_m);
  }

  std::vector<std::string> waypoints_;
  std::string scenario_;
  std::optional<std::int64_t> seed_;
  std::optional<double> speed_mps_;
  double radius_m_ = 3.0;
  std::string frame_ = "world";
  std::optional<double> timeout_s_;
  double patience_s_ = 10.0;
  bool halt_ = false;
  bool emergency_stop_ = false;
  bool release_ = false;
  bool json_ = false;
  std::string lcm_url_;
  std::optional<Geodetic> datum_;  // of the scenario
};

}  // namespace

void add_go_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Go>(rcs));
}

}  // namespace rcs::cli
