#include "rcs/node/command_port.h"

#include <algorithm>

#include "rcs/node/stop_latch.h"

namespace rcs {
namespace {

// Limit for stamps of messages: sums with it cannot overflow.
constexpr std::int64_t kLongest_us = 1'000'000'000'000'000;

bool plausible(std::int64_t utime) { return utime > -kLongest_us && utime < kLongest_us; }

bool is_stop(const command_t& m) { return m.kind == command_t::KIND_EMERGENCY_STOP; }
bool is_release(const command_t& m) { return m.kind == command_t::KIND_RELEASE; }

bool same_waypoints(const std::vector<waypoint_t>& a, const std::vector<waypoint_t>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const waypoint_t& v, const waypoint_t& w) {
                      return std::equal(std::begin(v.p_m), std::end(v.p_m), std::begin(w.p_m));
                    });
}

}  // namespace

CommandPort::CommandPort(Bus* bus, std::string_view command_channel, std::string_view stop_channel,
                         std::string_view status_channel, std::string_view issuer,
                         const CommandPortParams& params)
    : params_(params),
      commands_(bus, command_channel),
      stops_(bus, stop_channel),
      statuses_(bus, status_channel, 8) {
  issuer_ = command_.issuer = issuer;
  command_.boot_id = bus->publisher().boot_id;
}

// In lockstep (no boot id) the same run has the same ids.
std::int64_t CommandPort::new_stop_id() const {
  const std::int64_t random = command_.boot_id == 0 ? 0 : random_id();
  if (random != 0) return random;
  return std::max<std::int64_t>(id_of(command_.issuer, command_.serial), 1);
}

std::int64_t CommandPort::stop_id(std::int64_t number) {
  const auto known = std::find_if(numbered_.begin(), numbered_.end(),
                                  [number](const NumberedStop& s) { return s.number == number; });
  if (number != 0 && known != numbered_.end()) return known->id;
  const std::int64_t id = new_stop_id();
  if (number == 0) return id;
  if (numbered_.size() == kStops) numbered_.pop_front();
  numbered_.push_back({number, id});
  return id;
}

std::int64_t CommandPort::send(const Command& command, Stamp now) {
  command_.issuer = issuer_;
  command_.utime = to_utime(now);
  command_.serial = std::max(command_.serial + 1, to_utime(now));
  if (command.task == 0 || command.task != command_.task ||
      !same_waypoints(command.waypoints, command_.waypoint)) {
    command_.waypoints_done = 0;
  }
  command_.task = command.task;
  command_.kind = command.kind;
  command_.frame = command.frame;
  command_.map_epoch = command.map_epoch;
  command_.alert_limit_horizontal_m = command.alert_limit_horizontal_m;
  command_.alert_limit_vertical_m = command.alert_limit_vertical_m;
  command_.valid_until_utime = to_utime(now + command.valid_for);
  command_.waypoint = command.waypoints;
  command_.n = static_cast<std::int32_t>(command.waypoints.size());
  command_.stop_id = command.released;
  if (is_stop(command_)) {
    if (!command.on_behalf.empty()) command_.issuer += StopLatch::kOnBehalf + command.on_behalf;
    stop_id_ = stop_id(command.stop);
    command_.stop_id = {stop_id_};
  }
  command_.n_stops = static_cast<std::int32_t>(command_.stop_id.size());
  publish();
  first_sent_ = now;
  last_sent_ = now;
  sends_ = 1;
  echoed_ = done_ = false;
  return command_.serial;
}

void CommandPort::publish() {
  const bool stops = is_stop(command_) || is_release(command_);
  (stops ? stops_ : commands_).publish(&command_);
}

void CommandPort::step(Stamp now) {
  for (; !statuses_.empty(); statuses_.pop()) {
    const status_t& m = *statuses_.front();
    // A status that was delayed or repeated in transit reports a former state.
    if (!plausible(m.utime) || (received_ && m.utime <= status_.utime) ||
        from_utime(m.utime) > now) {
      continue;
    }
    status_ = m;
    received_ = true;
    received_at_ = now;
    // A stop in force that would not survive a restart is sent again, to reach the successor, too.
    if (sends_ > 0 && is_stop(command_)) {
      echoed_ = echoed_ || (m.emergency_stop == status_t::STOP_PERSISTED && lists_id(stop_id_));
    }
    if (!echoes_mine()) continue;
    echoed_ = echoed_ || !is_stop(command_);
    done_ = done_ || (echoed_ && m.status == status_t::STATUS_DONE);
    command_.waypoints_done = std::clamp(m.waypoints_done, command_.waypoints_done, command_.n);
  }
  const bool in_time = sends_ < params_.max_sends && now < from_utime(command_.valid_until_utime);
  const bool send_again = sends_ > 0 && !echoed_ && now - last_sent_ >= params_.resend &&
                          (in_time || is_stop(command_));
  if (!send_again) return;
  publish();
  last_sent_ = now;
  sends_ = std::min(sends_ + 1, params_.max_sends);
}

bool CommandPort::echoes_mine() const {
  return sends_ > 0 && status_.echo_serial == command_.serial && status_.issuer == command_.issuer;
}

bool CommandPort::lists(std::int64_t stop) const {
  return std::any_of(numbered_.begin(), numbered_.end(),
                     [&](const NumberedStop& s) { return s.number == stop && lists_id(s.id); });
}

bool CommandPort::lists_id(std::int64_t id) const {
  const std::vector<std::int64_t> mine = listed_stops(issuer_);
  return id != 0 && std::find(mine.begin(), mine.end(), id) != mine.end();
}

std::vector<std::int64_t> CommandPort::listed_stops(std::string_view issuer) const {
  std::vector<std::int64_t> ids;
  for (const stop_t& s : status_.stop) {
    if (issuer.empty() || StopLatch::is_of(s, issuer)) ids.push_back(s.id);
  }
  return ids;
}

CommandProgress CommandPort::progress(Stamp now) const {
  using State = CommandProgress::State;
  if (sends_ == 0) return {State::kIdle, ""};
  if (done_) return {State::kDone, ""};
  const bool silent = now - std::max(received_at_, first_sent_) > params_.silence;
  if (silent) {
    return {
        State::kError,
        "no status received within the limit: the receiver does not run, or is not on this bus"};
  }
  if (!echoed_) {
    if (echoes_mine() && status_.status == status_t::STATUS_ERROR) {
      return {State::kError, status_.reason};
    }
    const bool given_up = now - last_sent_ > params_.resend && sends_ >= params_.max_sends;
    const bool over = now >= from_utime(command_.valid_until_utime);
    if (given_up || over) return {State::kError, "the command is not accepted"};
    return {State::kSent, ""};
  }
  if (!echoes_mine()) {
    return {State::kError, status_.echo_serial == 0 ? "restarted since the command"
                                                    : "another command has replaced it"};
  }
  if (status_.status == status_t::STATUS_EXEC) return {State::kExecuting, ""};
  return {State::kError, status_.reason};
}

Subordinate::Subordinate(Bus* bus, std::string_view node, std::string_view command_channel,
                         std::string_view stop_channel, std::string_view status_channel,
                         const SubordinateParams& params)
    : params_(params),
      boot_id_(bus->publisher().boot_id),
      commands_(bus, command_channel, 16),
      stops_(bus, stop_channel, command_channel),
      releases_(bus, stop_channel, 16),
      statuses_(bus, status_channel) {
  status_.node = node;
  status_.boot_id = boot_id_;
}

void Subordinate::take(Stamp now, bool only_stops) {
  if (!start_) start_ = now;
  is_new_ = false;
  while (!releases_.empty() && is_stop(*releases_.front())) releases_.pop();
  // The other commands wait, whether they arrived before it or after.
  if (take_stop(only_stops) || only_stops) return;
  if (!take_from(&releases_, now)) take_from(&commands_, now);
}

// @return a release was accepted, and the commands after it wait
bool Subordinate::take_from(Inbox<command_t>* inbox, Stamp now) {
  for (; !inbox->empty(); inbox->pop()) {
    const command_t& m = *inbox->front();
    const bool belongs = inbox == &commands_ ? !is_stop(m) : is_release(m);
    if (!belongs || !admit(m, now)) continue;
    command_ = m;
    in_force_ = true;
    is_new_ = true;
    ++account_.taken;
    note_task();
    if (!is_release(command_)) continue;
    inbox->pop();
    return true;
  }
  return false;
}

// No rule applies, and the issuer's record is unchanged: the serial of a stop must not make other
// commands of its issuer stale.
// @return a stop is the command in force since this cycle
bool Subordinate::take_stop(bool only_new) {
  const command_t* const m = stops_.take();
  if (m == nullptr || (only_new && !stops_.took_new())) return false;
  if (in_force_ && is_stop(command_) && m->issuer == command_.issuer &&
      m->serial == command_.serial && m->utime == command_.utime) {
    ++account_.repeated;
    return false;
  }
  command_ = *m;
  in_force_ = true;
  is_new_ = true;
  task_ended_ = false;
  ++account_.taken;
  return true;
}

void Subordinate::note_task() {
  Issuer* const from = issuer(command_);
  task_ended_ = from != nullptr && command_.task != 0 && command_.task == from->ended_task;
  if (from != nullptr && command_.task != 0) from->task = command_.task;
}

void Subordinate::end_tasks() {
  for (Issuer& i : issuers_) i.ended_task = i.task;
  task_ended_ = in_force_ && command_.task != 0;
}

// Every rule errs on the side of not acting: a superior that is not echoed issues a new command.
// The issuer's record is updated last: a rejected command must not make others stale.
bool Subordinate::admit(const command_t& m, Stamp now) {
  const bool sane = plausible(m.utime) && plausible(m.valid_until_utime) && m.serial > 0 &&
                    m.serial <= to_utime(now + params_.serial_ahead) &&
                    m.issuer.size() <= StopReceiver::kMaxIssuer && from_utime(m.utime) <= now &&
                    from_utime(m.valid_until_utime) - from_utime(m.utime) <= params_.longest;
  if (!sane) {
    ++account_.implausible;
    return false;
  }
  if (m.boot_id != boot_id_) {
    ++account_.other_boot;
    return false;
  }
  if (from_utime(m.utime) < *start_) {
    ++account_.before_start;
    return false;
  }
  if (in_force_ && m.issuer == command_.issuer && m.serial == command_.serial) {
    ++account_.repeated;
    return false;
  }
  if (now >= from_utime(m.valid_until_utime)) {
    ++account_.expired;
    return false;
  }
  // The issuer of the release did not know of the stop.
  if (m.kind == command_t::KIND_RELEASE && from_utime(m.utime) <= stops_.last_arrival()) {
    ++account_.stale;
    return false;
  }
  Issuer* const from = issuer(m);
  if (from == nullptr || m.serial <= from->serial) {
    ++account_.stale;
    return false;
  }
  from->serial = m.serial;
  from->issued = std::max(from->issued, from_utime(m.utime));
  return true;
}

// Null: the issuer has no record, and the command may be older than its removed record.
Subordinate::Issuer* Subordinate::issuer(const command_t& m) {
  for (Issuer& i : issuers_) {
    if (i.serial > 0 && i.name == m.issuer) return &i;
  }
  if (from_utime(m.utime) <= forgotten_) return nullptr;
  Issuer* const oldest =
      &*std::min_element(issuers_.begin(), issuers_.end(),
                         [](const Issuer& a, const Issuer& b) { return a.issued < b.issued; });
  forgotten_ = std::max(forgotten_, oldest->issued);
  oldest->name = m.issuer;
  oldest->serial = 0;
  oldest->issued = Stamp::min();
  oldest->task = oldest->ended_task = 0;
  return oldest;
}

void Subordinate::report(Stamp now, const StatusReport& report) {
  status_.utime = to_utime(now);
  status_.issuer = in_force_ ? std::string_view(command_.issuer) : std::string_view();
  status_.echo_serial = in_force_ ? command_.serial : 0;
  status_.new_command = is_new_ ? 1 : 0;
  status_.status = report.status;
  status_.degrade_level = static_cast<std::int8_t>(report.degrade_level);
  status_.waypoints_done = report.waypoints_done;
  status_.state = report.state;
  status_.emergency_stop = report.emergency_stop;
  status_.stop.clear();
  if (report.stops != nullptr) status_.stop = *report.stops;
  status_.n_stops = static_cast<std::int32_t>(status_.stop.size());
  status_.source_line = report.line;
  status_.reason = report.reason;
  statuses_.publish(&status_);
}

}  // namespace rcs
