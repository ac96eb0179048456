#include "rcs/node/command_port.h"

#include <algorithm>

namespace rcs {
namespace {

// Limit for stamps of messages: sums with it cannot overflow.
constexpr std::int64_t kLongest_us = 1'000'000'000'000'000;

bool plausible(std::int64_t utime) { return utime > -kLongest_us && utime < kLongest_us; }

bool is_stop(const command_t& m) { return m.kind == command_t::KIND_EMERGENCY_STOP; }

}  // namespace

CommandPort::CommandPort(Bus* bus, std::string_view command_channel,
                         std::string_view status_channel, std::string_view issuer,
                         const CommandPortParams& params)
    : params_(params), commands_(bus, command_channel), statuses_(bus, status_channel, 8) {
  command_.issuer = issuer;
}

std::int64_t CommandPort::send(const Command& command, Stamp now) {
  command_.utime = to_utime(now);
  command_.serial = std::max(command_.serial + 1, to_utime(now));
  if (command.task == 0 || command.task != command_.task) command_.waypoints_done = 0;
  command_.task = command.task;
  command_.kind = command.kind;
  command_.frame = command.frame;
  command_.alert_limit_horizontal_m = command.alert_limit_horizontal_m;
  command_.alert_limit_vertical_m = command.alert_limit_vertical_m;
  command_.valid_until_utime = to_utime(now + command.valid_for);
  command_.waypoint = command.waypoints;
  command_.n = static_cast<std::int32_t>(command.waypoints.size());
  commands_.publish(&command_);
  first_sent_ = now;
  last_sent_ = now;
  sends_ = 1;
  echoed_ = seen_ = replaced_ = false;
  done_ = false;
  return command_.serial;
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
    if (!echoes_mine()) {
      // Further copies of a stop that another superior has released would be ignored.
      replaced_ = replaced_ || (is_stop(command_) && seen_ && !echoed_);
      continue;
    }
    seen_ = true;
    // A stop in force that would not survive a restart is sent again, to reach the successor, too.
    echoed_ = echoed_ || !is_stop(command_) || m.status != status_t::STATUS_ERROR;
    done_ = done_ || m.status == status_t::STATUS_DONE;
    command_.waypoints_done = std::clamp(m.waypoints_done, command_.waypoints_done, command_.n);
  }
  const bool in_time = sends_ < params_.max_sends && now < from_utime(command_.valid_until_utime);
  const bool send_again = sends_ > 0 && !echoed_ && now - last_sent_ >= params_.resend &&
                          (in_time || is_stop(command_));
  if (!send_again) return;
  if (replaced_) {
    command_.utime = to_utime(now);
    command_.serial = std::max(command_.serial + 1, command_.utime);
    seen_ = replaced_ = false;
  }
  commands_.publish(&command_);
  last_sent_ = now;
  sends_ = std::min(sends_ + 1, params_.max_sends);
}

bool CommandPort::echoes_mine() const {
  return sends_ > 0 && status_.echo_serial == command_.serial && status_.issuer == command_.issuer;
}

CommandProgress CommandPort::progress(Stamp now) const {
  using State = CommandProgress::State;
  if (sends_ == 0) return {State::kIdle, ""};
  if (done_) return {State::kDone, ""};
  const bool silent = now - std::max(received_at_, first_sent_) > params_.silence;
  if (silent) return {State::kError, "no status for too long"};
  if (!echoed_) {
    if (echoes_mine()) return {State::kError, status_.reason};
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

void StopReceiver::receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept {
  try {
    if (size > InboxBase::kMaxMessageBytes) return;
    if (scratch_.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) return;
  } catch (const std::bad_alloc&) {
    return;  // the command inbox counts malformed messages
  }
  if (!is_stop(scratch_)) return;
  if (scratch_.issuer.size() > kMaxIssuer) scratch_.issuer.resize(kMaxIssuer);
  // A copy must not displace a new stop.
  const Record* const known = find(scratch_);
  if (known != nullptr && (known->released || pending_)) return;
  std::swap(newest_, scratch_);
  pending_ = true;
  pending_arrival_ = arrival;
}

bool StopReceiver::take() {
  pending_ = false;
  if (find(newest_) != nullptr) return false;
  last_arrival_ = std::max(last_arrival_, pending_arrival_);
  Record& record = records_[next_record_];
  next_record_ = (next_record_ + 1) % records_.size();
  record.issuer = newest_.issuer;
  record.serial = newest_.serial;
  record.utime = newest_.utime;
  record.released = false;
  record.used = true;
  return true;
}

void StopReceiver::release() {
  for (Record& r : records_) r.released = r.used;
}

StopReceiver::Record* StopReceiver::find(const command_t& m) {
  Record* const found = std::find_if(records_.begin(), records_.end(), [&](const Record& r) {
    return r.used && r.serial == m.serial && r.utime == m.utime && r.issuer == m.issuer;
  });
  return found == records_.end() ? nullptr : found;
}

Subordinate::Subordinate(Bus* bus, std::string_view node, std::string_view command_channel,
                         std::string_view status_channel, const SubordinateParams& params)
    : params_(params),
      commands_(bus, command_channel, 16),
      stops_(bus, command_channel),
      statuses_(bus, status_channel) {
  status_.node = node;
}

void Subordinate::take(Stamp now) {
  if (!start_) start_ = now;
  is_new_ = false;
  if (stops_.pending() != nullptr) {
    take_stop();  // the other commands wait, whether they arrived before it or after
    return;
  }
  for (; !commands_.empty(); commands_.pop()) {
    const command_t& m = *commands_.front();
    if (is_stop(m) || !admit(m, now)) continue;
    command_ = m;
    in_force_ = true;
    is_new_ = true;
    ++account_.taken;
    if (command_.kind != command_t::KIND_RELEASE) continue;
    commands_.pop();
    return;
  }
}

// No rule applies, and the issuer's record is unchanged: the serial of a stop must not make other
// commands of its issuer stale.
void Subordinate::take_stop() {
  const command_t& m = *stops_.pending();
  const bool first = stops_.take();
  if (!first && in_force_ && is_stop(command_) && m.issuer == command_.issuer &&
      m.serial == command_.serial && m.utime == command_.utime) {
    ++account_.repeated;
    return;
  }
  command_ = m;
  in_force_ = true;
  is_new_ = true;
  ++account_.taken;
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
  status_.source_line = report.line;
  status_.reason = report.reason;
  statuses_.publish(&status_);
}

}  // namespace rcs
