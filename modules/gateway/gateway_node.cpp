#include "modules/gateway/gateway_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "modules/gateway/sample_conversion.h"
#include "rcs/node/budget.h"
#include "rcs/node/stop_latch.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::gateway {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr Duration kFirstStatus = from_milliseconds(200.0);  // BG publishes one every 50 ms
constexpr char kSelf[] = "gateway";
constexpr char kBg[] = "bg";
constexpr char kMission[] = "mission";

std::vector<std::string> table_names(const GatewayConfig& config) {
  std::vector<std::string> names = config.nodes;
  names.emplace_back(kSelf);
  return names;
}

std::string_view text(CommandArbiter::Phase phase) {
  constexpr std::string_view kTexts[] = {"idle",    "goto",   "done",           "failed",
                                         "silence", "halted", "emergency stop", "releasing"};
  return kTexts[static_cast<std::size_t>(phase)];
}

/// The newest waiting message; null: none. Valid until the next advance().
template <class T>
const T* take_newest(Inbox<T>* inbox) {
  const T* const newest = inbox->latest();
  if (newest != nullptr) inbox->pop();
  return newest;
}

}  // namespace

GatewayNode::NodeInbox::NodeInbox(Bus* bus, std::string_view node)
    : cycles(bus, channel_of(node, "CYCLE"), 16), processes(bus, channel_of(node, "PROCESS"), 2) {}

GatewayNode::GatewayNode(const GatewayConfig& config, std::unique_ptr<DdsLink> dds, Bus* bus,
                         IdentityReport::WallClock wall_clock)
    : config_(config),
      clock_(config.period),
      state_clock_(config.state_period),
      dds_(std::move(dds)),
      nav_states_(bus, channel::kWmNavState, 16),
      port_(bus, channel::kBgCommand, channel::kBgStop, channel::kBgStatus, kSelf, config.port),
      report_(bus, config.info.name, kReportInterval),
      table_(table_names(config), config.node_status),
      arbiter_(config.arbiter) {
  if (dds_->identity()) {
    identity_.emplace(dds_->identity()->validity, config.vehicle, wall_clock);
  }
  if (config.arbiter.limits.tasks) {
    mission_.emplace(bus, channel::kMissionCommand, channel::kBgStop, channel::kMissionStatus,
                     kSelf, config.mission_port);
  }
  for (std::size_t i = 0; i < table_.size(); ++i) {
    node_inboxes_.emplace_back(bus, table_.name(i));
  }
  to_sample(config.vehicle, state_.vehicle);
  to_sample(config.vehicle, status_.vehicle);
}

std::vector<const InboxBase*> GatewayNode::inboxes() const {
  std::vector<const InboxBase*> all = {&nav_states_, &port_.inbox()};
  if (mission_) all.push_back(&mission_->inbox());
  for (const NodeInbox& i : node_inboxes_) {
    all.push_back(&i.cycles);
    all.push_back(&i.processes);
  }
  return all;
}

std::string_view GatewayNode::note() const {
  return identity_ ? std::string_view(identity_->note()) : std::string_view();
}

void GatewayNode::run(const Cycle& cycle) {
  const Stamp now = cycle.now;
  if (!started_) {
    started_at_ = now;
    report_start(now);
  }
  take_nodes(now);
  cycle.stages->mark("receive");

  take_stops(now);  // first: a stop rejects the commands of the same cycle
  take_commands(now);
  report_operator(now);
  report_phase(now);
  cycle.stages->mark("command");

  // On the grid of the cycles, so that a late cycle does not delay a state by a whole one.
  if (state_clock_.due(cycle.wakeup)) {
    state_clock_.advance(cycle.wakeup);
    send_state(now);
  }
  if (identity_) identity_->update(now, &report_);
  describe_self(now);
  send_status(now);
  cycle.stages->mark("send");
  if (clock_.due(now)) clock_.advance(now);
  cycle.stages->close_account();
}

void GatewayNode::report_start(Stamp now) {
  started_ = true;
  if (config_.unsecured) {
    report_.publish(now, event::kGatewayUnsecured,
                    "DDS without keys: everyone on {} can command {}",
                    config_.dds.network.interface, config_.vehicle);
  } else {
    const std::optional<int>& revoked = dds_->identity()->revoked;
    report_.publish(
        now, event::kGatewaySecured,
        "DDS secured: {} uses interface {} with the keys in {}; {}; valid until {}",
        config_.vehicle, config_.dds.network.interface, config_.dds.keys,
        revoked ? fmt::format("{} revoked in crl.pem", *revoked) : "no revocation list (crl.pem)",
        dds::end_text(dds_->identity()->validity));
  }
}

// ---- the vehicle's nodes -------------------------------------------------------------------

void GatewayNode::take_nodes(Stamp now) {
  const Stamp arrival = nav_states_.account().last_arrival;
  if (const nav_state_t* m = take_newest(&nav_states_)) {
    nav_state_ = *m;
    nav_arrival_ = arrival;
  }
  for (std::size_t i = 0; i < table_.size(); ++i) take_node(i, now);
}

void GatewayNode::take_node(std::size_t i, Stamp now) {
  NodeFacts& facts = table_.facts(i);
  NodeInbox& inbox = node_inboxes_[i];
  if (const cycle_t* m = take_newest(&inbox.cycles)) {
    table_.receive(i, now);
    facts.degrade_level = m->degrade_level;
    facts.missed = m->missed;
    facts.overruns = m->overruns;
  }
  if (const process_t* m = take_newest(&inbox.processes)) {
    table_.receive(i, now);
    facts.cycles = m->cycles;
    facts.missed = m->missed;
    facts.overruns = m->overruns;
    facts.degrade_level = m->degrade_level;
    facts.reason = m->note;
  }
  if (table_.name(i) == kSelf) return;
  facts.state = table_.alive(i, now) ? "running" : "silent";
  if (table_.name(i) == kBg) take_status(i, port_, &bg_received_, now);
  if (table_.name(i) == kMission && mission_) take_status(i, *mission_, &mission_received_, now);
}

void GatewayNode::take_status(std::size_t i, const CommandPort& port, std::int64_t* received,
                              Stamp now) {
  const status_t* const status = port.status();
  if (status == nullptr) return;
  if (port.inbox().account().received != *received) table_.receive(i, now);
  *received = port.inbox().account().received;
  if (!table_.alive(i, now)) return;
  NodeFacts& facts = table_.facts(i);
  facts.state = status->state;
  facts.reason = status->reason;
  facts.degrade_level = status->degrade_level;
}

// ---- operators -----------------------------------------------------------------------------

void GatewayNode::take_stops(Stamp now) {
  const DdsLink::Stops samples = dds_->take_stops();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const rcs_EmergencyStop* const sample = samples.data(i);
    if (sample == nullptr || sample->vehicle != config_.vehicle) continue;
    const StopCommand command = from_sample(*sample, dds_->partition_of(samples, i));
    refuse(arbiter_.accept(command, now), "EmergencyStop", command.operator_id, command.command_id,
           now);
    if (command.engage) stops_.press(command.operator_id, now);
  }
  if (dds_->take_refused_release()) {
    refuse(Refusal::kOperator, "EmergencyStop", "", 0, now);
  }
  if (!dds_->take_unnamed_stop()) return;
  refuse(arbiter_.accept(StopCommand{}, now), "EmergencyStop", "", 0, now);
  stops_.press("", now);
}

void GatewayNode::take_commands(Stamp now) {
  const DdsLink::Commands samples = dds_->take_commands();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const rcs_WaypointCommand* const sample = samples.data(i);
    if (sample == nullptr || sample->vehicle != config_.vehicle) continue;
    const WaypointCommand command = from_sample(*sample, dds_->partition_of(samples, i));
    refuse(arbiter_.accept(command, now), "WaypointCommand", command.operator_id,
           command.command_id, now);
  }
}

void GatewayNode::refuse(Refusal refusal, std::string_view topic, std::string_view operator_id,
                         std::int64_t command_id, Stamp now) {
  if (refusal == Refusal::kNone) return;
  ++refused_;
  last_refusal_ =
      fmt::format("{} {} of {}: {}", topic, command_id,
                  operator_id.empty() ? "an unauthorized operator" : operator_id, text(refusal));
  report_.publish(now, event::kGatewayCommandRejected, "{}: command rejected, {} rejected so far",
                  last_refusal_, refused_);
}

namespace {

/// The operator of a stop that the gateway has set; empty: unknown.
std::string_view operator_of(const stop_t& stop) {
  const std::string_view issuer = stop.issuer;
  return issuer.substr(std::min(issuer.size(), sizeof kSelf));  // after "gateway:"
}

}  // namespace

bool GatewayNode::is_listed_of(std::string_view operator_id) const {
  const std::vector<stop_t>& stops = port_.status()->stop;
  return std::any_of(stops.begin(), stops.end(), [&](const stop_t& stop) {
    return StopLatch::is_of(stop, kSelf) && operator_of(stop) == operator_id;
  });
}

/// The stops of a former process of the gateway are those of its operators.
void GatewayNode::adopt_stops(Stamp now) {
  if (adopted_ || port_.status() == nullptr) return;
  adopted_ = true;
  for (const stop_t& stop : port_.status()->stop) {
    if (!StopLatch::is_of(stop, kSelf)) continue;
    arbiter_.adopt_stop(operator_of(stop), now);
    stops_.adopt(operator_of(stop));
  }
}

void GatewayNode::report_operator(Stamp now) {
  using Phase = CommandArbiter::Phase;
  port_.step(now);
  if (mission_) mission_->step(now);
  adopt_stops(now);
  const bool of_mission = mission_ && arbiter_.phase() == Phase::kGoto;
  const CommandProgress current = of_mission ? mission_->progress(now) : port_.progress(now);
  Progress progress = Progress::kUnderway;
  if (current.state == CommandProgress::State::kDone) progress = Progress::kDone;
  if (current.state == CommandProgress::State::kError) {
    progress = Progress::kError;
    failure_ = current.reason;
  }
  // The stops of other superiors are theirs to release.
  if (arbiter_.phase() == Phase::kReleasing && port_.confirmed() &&
      port_.listed_stops(kSelf).empty()) {
    progress = Progress::kDone;
  }
  const std::optional<Action> action = arbiter_.decide(now, progress);
  const bool refresh = action && action->kind == Action::Kind::kEmergencyStop;
  const auto is_listed = [this](const OperatorStops::Stop& s) {
    return s.number != 0 ? port_.lists(s.number) : is_listed_of(s.operator_id);
  };
  // A stop that DDS still has from before a restart is mostly one that BG lists: the first status
  // of BG is waited for, so that each restart does not add another one to the latch.
  const bool waits = !adopted_ && now - started_at_ < kFirstStatus;
  const std::optional<OperatorStops::Stop> stop =
      waits ? std::nullopt : stops_.update(arbiter_.engaged(), now, is_listed, refresh);
  for (const std::string& name : stops_.take_ended()) arbiter_.end_stop(name);
  if (stop && arbiter_.phase() == Phase::kStopped) {
    Command command =
        to_command({Action::Kind::kEmergencyStop, config_.arbiter.valid_for, nullptr});
    command.stop = stop->number;
    command.on_behalf = stop->operator_id;
    return send(command, now);
  }
  if (!action || refresh) return;
  Command command = to_command(*action);
  if (command.kind == command_t::KIND_RELEASE) command.released = port_.listed_stops(kSelf);
  send(command, now);
}

void GatewayNode::send(const Command& command, Stamp now) {
  const bool halts = command.kind == command_t::KIND_HALT;
  const bool of_stop =
      command.kind == command_t::KIND_EMERGENCY_STOP || command.kind == command_t::KIND_RELEASE;
  if (mission_ && !of_stop) (void)mission_->send(command, now);
  // A halt goes to BG, too, which acts on it sooner.
  if (!mission_ || halts || of_stop) (void)port_.send(command, now);
}

void GatewayNode::report_phase(Stamp now) {
  using Phase = CommandArbiter::Phase;
  const Phase phase = arbiter_.phase();
  if (phase == reported_phase_ && arbiter_.command_id() == reported_id_) return;
  reported_phase_ = phase;
  reported_id_ = arbiter_.command_id();
  const std::string_view who =
      arbiter_.operator_id().empty() ? "an unknown operator" : arbiter_.operator_id();
  const std::int64_t which = arbiter_.command_id();
  switch (phase) {
    case Phase::kIdle:
      report_.publish(now, event::kGatewayCommandIdle,
                      "BG has accepted the release of the emergency stop");
      break;
    case Phase::kGoto:
      report_.publish(now, event::kGatewayCommandGoto, "command {} of {} in force", which, who);
      break;
    case Phase::kDone:
      report_.publish(now, event::kGatewayCommandDone, "command {} of {} completed", which, who);
      break;
    case Phase::kFailed:
      report_.publish(now, event::kGatewayCommandFailed, "command {} of {} failed: {}", which, who,
                      failure_);
      break;
    case Phase::kSilent:
      report_.publish(
          now, event::kGatewayOperatorSilent,
          "operator {} silent for its valid_for: command {} ended, a new command is required", who,
          which);
      break;
    case Phase::kHalted:
      report_.publish(now, event::kGatewayCommandHalt, "halt command {} of {}", which, who);
      break;
    case Phase::kStopped:
      report_.publish(now, event::kGatewayStopEngaged, "emergency stop {} of {} engaged", which,
                      who);
      break;
    case Phase::kReleasing:
      report_.publish(now, event::kGatewayStopReleased, "emergency stop released by {}, command {}",
                      who, which);
      break;
  }
}

// ---- what goes out -------------------------------------------------------------------------

void GatewayNode::send_state(Stamp now) {
  const bool known = nav_arrival_ != Stamp::min() && now - nav_arrival_ <= config_.state_max_age;
  // An old or invalid pose could be mistaken for a valid one: no sample is published instead.
  if (!known || nav_state_.pose_valid == 0) return;
  if (!to_sample(nav_state_, now - nav_arrival_, &state_)) {
    report_.publish(now, event::kGatewayStateRejected,
                    "{}: mode {} unknown or a number not finite, VehicleState not published",
                    channel::kWmNavState, nav_state_.mode);
    return;
  }
  ++state_.seq;
  (void)dds_->write(state_);
}

void GatewayNode::describe_self(Stamp now) {
  const std::size_t self = table_.size() - 1;
  NodeFacts& facts = table_.facts(self);
  table_.receive(self, now);
  facts.state =
      fmt::format("{}; {}", config_.unsecured ? "unsecured" : "secured", text(arbiter_.phase()));
  if (!arbiter_.operator_id().empty()) {
    facts.state += fmt::format(" {} {}", arbiter_.operator_id(), arbiter_.command_id());
  }
  facts.reason = identity_ ? identity_->note() : "";  // first, because a long reason is cut
  const auto add = [&facts](const std::string& text) {
    if (!facts.reason.empty()) facts.reason += "; ";
    facts.reason += text;
  };
  if (arbiter_.phase() == CommandArbiter::Phase::kFailed) add(failure_);
  if (refused_ > 0) add(fmt::format("{} rejected, last: {}", refused_, last_refusal_));
}

void GatewayNode::send_status(Stamp now) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    if (!table_.take_due(i, now)) continue;
    to_sample(table_, i, now, &status_);
    ++status_.seq;
    (void)dds_->write(status_);
  }
  if (dds_->write_failures() != reported_failures_) {
    reported_failures_ = dds_->write_failures();
    report_.publish(now, event::kGatewayDdsWrite, "{} samples rejected by DDS so far and lost",
                    reported_failures_);
  }
}

Result<std::unique_ptr<Node>> make_gateway_node(const ParamFile& file, Bus* bus) {
  Result<GatewayConfig> config = load_gateway_config(file);
  if (!config) return config.error();
  Result<std::unique_ptr<DdsLink>> dds = DdsLink::open(config->dds, config->vehicle);
  if (!dds) return dds.error();
  return std::unique_ptr<Node>(
      std::make_unique<GatewayNode>(*config, std::move(dds).value(), bus, wall_utime));
}

}  // namespace rcs::gateway
