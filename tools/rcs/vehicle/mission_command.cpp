// rcs mission: tasks for the vehicle level

#include <fmt/format.h>

#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "tools/base/random_places.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/operator_session.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kMissionName = "mission";

class Mission final : public Command {
 public:
  explicit Mission(CLI::App* rcs)
      : Command(rcs->add_subcommand("mission", "Give the vehicle a task: visit, follow, return")) {
    app()
        ->add_option(
            "TASK", task_,
            "visit: drive to the places on routes that the mission chooses; follow: drive\n"
            "along the places; return: drive back on the way driven so far; hold: stop")
        ->required()
        ->check(CLI::IsMember({"visit", "follow", "return", "hold"}));
    add_repeated(app(), "--place", &places_, "a place in frame world: east, north [m]")
        ->type_name("X,Y");
    app()
        ->add_option("--radius", radius_m_, "distance at which a place counts as visited [m]")
        ->check(CLI::Range(0.5, 50.0))
        ->capture_default_str();
    app()
        ->add_option("--speed", speed_mps_, "speed limit [m/s]")
        ->check(CLI::Range(0.1, 30.0))
        ->capture_default_str();
    app()
        ->add_option("--alert-limit", alert_limit_m_,
                     "horizontal alert limit of the task [m]; default: [mission] alert_limit_m")
        ->check(CLI::Range(0.1, 1000.0));
    app()
        ->add_option(
            "--timeout", timeout_s_,
            "time limit [s]; when exceeded the vehicle is held, status 1; default: no limit")
        ->check(CLI::Range(0.0, 1e6));
    app()->add_flag(
        "--detach", detach_,
        "end once the mission has accepted the task; [mission] operator_lost says what\n"
        "happens to a task that is not renewed");
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--json", json_, "print the result as JSON");
    app()->footer(
        "The node `mission` must run ([up] nodes). The task is renewed every 4 s until it is "
        "done.\n"
        "Ctrl-C holds the vehicle first. `rcs log csv LOG --channel MISSION_ROUTES` has the\n"
        "candidate routes of a recording with their values. Status 0: done, or accepted (hold,\n"
        "--detach); 1: not done or refused, with the reason; 3: no mission on the bus.\n"
        "Examples:\n"
        "  rcs mission visit --place 400,120 --place 650,80 --alert-limit 3\n"
        "  rcs mission return");
  }

  int run() override {
    const bool has_places = task_ == "visit" || task_ == "follow";
    if (has_places == places_.empty()) {
      fmt::print(stderr, "rcs mission: {} {} --place\n", task_,
                 has_places ? "requires" : "excludes");
      return kExitUsage;
    }
    rcs::Command command;
    command.kind = task_ == "visit"    ? command_t::KIND_GOTO
                   : task_ == "follow" ? command_t::KIND_FOLLOW
                   : task_ == "return" ? command_t::KIND_RETURN
                                       : command_t::KIND_HALT;
    command.alert_limit_horizontal_m = alert_limit_m_;
    for (const std::string& text : places_) {
      const std::optional<Vec2> place = tools::parse_place(text);
      if (!place) {
        fmt::print(stderr, "rcs mission: --place {}: expected X,Y in metres\n", text);
        return kExitUsage;
      }
      waypoint_t w{};
      to_message(Vec3(place->x(), place->y(), 0.0), w.p_m);
      w.radius_m = radius_m_;
      w.speed_mps = speed_mps_;
      command.waypoints.push_back(w);
    }
    const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(lcm_url_);
    if (!bus) return fail(kMissionName, bus.error());
    OperatorSession session(bus->get(), kMissionNode);
    const Stamp begin = session.now();
    const Ending ending = pursue(&session, command);
    session.end_line();
    if (const Outcome status = (*bus)->status(); !status) return fail(kMissionName, status.error());
    const bool no_mission = !ending.good && session.state().empty();
    if (json_ && !no_mission && !was_interrupted()) {
      const int done = session.status() != nullptr ? session.status()->waypoints_done : 0;
      fmt::print("{}",
                 report::json_document(kMissionName, {{"task", task_},
                                                      {"result", ending.result},
                                                      {"reason", ending.reason},
                                                      {"state", session.state()},
                                                      {"places", command.waypoints.size()},
                                                      {"places_done", done},
                                                      {"time_s", seconds(session.now() - begin)}}));
    }
    if (ending.good && !json_) fmt::print("{}\n", ending.result);
    if (ending.good) return kExitOk;
    return no_mission ? fail(kMissionName, Error{ending.reason})
                      : negative(kMissionName, Error{ending.reason});
  }

 private:
  [[nodiscard]] Ending pursue(OperatorSession* session, const rcs::Command& command) const {
    if (command.kind == command_t::KIND_HALT || detach_) return session->send_once(command);
    constexpr Duration kPatience = from_seconds(10.0);
    const Duration most = timeout_s_ ? from_seconds(*timeout_s_) : Duration::max();
    Ending ending = session->pursue(command, most, kPatience);
    if (ending.result != "interrupted" && ending.result != "timeout") return ending;
    session->end_line();
    const Ending held = session->send_once({});
    ending.reason += held.good ? "; the vehicle is held"
                               : "; the mission does not confirm that it holds: " + held.reason;
    return ending;
  }

  std::string task_;
  std::vector<std::string> places_;
  double radius_m_ = 3.0;
  double speed_mps_ = 5.0;
  double alert_limit_m_ = 0.0;
  std::optional<double> timeout_s_;
  bool detach_ = false;
  bool json_ = false;
  std::string lcm_url_;
};

}  // namespace

void add_mission_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Mission>(rcs));
}

}  // namespace rcs::cli
