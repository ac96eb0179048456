#include "tests/bg/stop_sequence.h"

#include <algorithm>

#include "rcs/node/stop_latch.h"
#include "rcs/node/stop_receiver.h"

namespace rcs::bg::test {
namespace {

constexpr std::int8_t kGoto = command_t::KIND_GOTO;
constexpr std::int8_t kStop = command_t::KIND_EMERGENCY_STOP;
constexpr std::int8_t kRelease = command_t::KIND_RELEASE;
constexpr std::int64_t kSerialAhead_us = 1'000'000;  // of the subordinate

std::string name_of(std::int8_t kind) {
  switch (kind) {
    case kGoto:
      return "goto";
    case kStop:
      return "stop";
    case kRelease:
      return "release";
    default:
      return "halt";
  }
}

}  // namespace

DrawnEvent SequenceDraw::draw(std::size_t stops) {
  const auto changed = [this](std::int8_t kind, const char* how, const auto& change) {
    DrawnEvent e = fresh(kind);
    change(&e.command);
    e.what += how;
    return e;
  };
  switch (below(12)) {
    case 0:
    case 1:
    case 2:
    case 3:
      return fresh(kGoto);
    case 4:
      return stops < kMaxStops ? fresh(kStop) : DrawnEvent{};
    case 5:
    case 6:
      return fresh(kRelease);
    case 7:
      if (below(3) > 0) return {};
      return {DrawnEvent::Kind::kKill, {}, "kill"};
    case 8:
      return changed(one_of({kGoto, kRelease}), ", expired",
                     [this](command_t* m) { m->valid_until_utime = m->utime - below(3); });
    case 9:
      return replay();
    case 10:
      return changed(one_of({kGoto, kRelease}), ", of another start of the computer",
                     [this](command_t* m) { m->boot_id += 1 + below(5); });
    default:
      return of_the_future(stops);
  }
}

DrawnEvent SequenceDraw::fresh(std::int8_t kind) {
  const std::string issuer =
      issuers_[static_cast<std::size_t>(below(static_cast<int>(issuers_.size())))];
  DrawnEvent e{DrawnEvent::Kind::kSend, issue_(kind, issuer), name_of(kind) + " of " + issuer};
  command_t& m = e.command;
  const auto random_stop = [this] {
    return std::uniform_int_distribution<std::int64_t>(1)(random_);
  };
  if (kind == kStop && below(4) > 0) {
    m.stop_id = {random_stop()};
  } else if (kind == kRelease && below(6) == 0) {
    m.stop_id = {random_stop()};
    e.what += " with a wrong id";
  } else if (kind == kRelease && !m.stop_id.empty() && below(4) == 0) {
    m.stop_id.erase(m.stop_id.begin() + below(static_cast<int>(m.stop_id.size())));
    e.what += " without one of the ids";
  }
  m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
  return e;
}

DrawnEvent SequenceDraw::replay() {
  if (sent_.empty()) return {};
  const command_t& m = sent_[static_cast<std::size_t>(below(static_cast<int>(sent_.size())))];
  return {DrawnEvent::Kind::kSend, m, name_of(m.kind) + " of " + m.issuer + ", replayed"};
}

DrawnEvent SequenceDraw::of_the_future(std::size_t stops) {
  DrawnEvent e = fresh(one_of({kGoto, kStop, kRelease, command_t::KIND_HALT}));
  if (e.command.kind == kStop && stops >= kMaxStops) return {};
  e.command.serial += below(2) == 0 ? 900'000 : 5'000'000;
  if (below(4) == 0) e.command.serial = INT64_MAX;
  e.what += ", serial of the future";
  return e;
}

void StopLaw::take(const command_t& m, Stamp arrival) {
  if (m.kind == kStop) {
    const std::int64_t id = stop_id_of(m);
    if (!released(id)) in_force_.emplace(id, Stop{m.issuer});
  }
  // A copy is no second release.
  if (m.kind != kRelease || !seen_.emplace(m.issuer, m.serial).second) return;
  const bool valid = m.boot_id == boot_id_ && m.serial <= m.utime + kSerialAhead_us &&
                     to_utime(arrival) < m.valid_until_utime;
  if (valid) pending_.push_back({m, arrival + release_within_});
}

void StopLaw::restarted(std::int64_t boot_id, bool may_have_acted) {
  boot_id_ = boot_id;
  for (auto stop = in_force_.begin(); stop != in_force_.end();) {
    const bool ended = may_have_acted && has_release_of(stop->first, stop->second);
    stop = stop->second.persisted && !ended ? std::next(stop) : in_force_.erase(stop);
  }
  released_.clear();
  pending_.clear();
}

bool StopLaw::has_release_of(std::int64_t id, const Stop& stop) const {
  return std::any_of(pending_.begin(), pending_.end(), [&](const Pending& p) {
    const std::vector<std::int64_t>& ids = p.message.stop_id;
    return permits(p.message, stop) && std::find(ids.begin(), ids.end(), id) != ids.end();
  });
}

bool StopLaw::permits(const command_t& release, const Stop& stop) const {
  return release.issuer == authority_ || StopLatch::is_of({0, stop.issuer}, release.issuer);
}

void StopLaw::take(const status_t& m, Stamp now, bool at_rest) {
  const auto lists = [&m](std::int64_t id) {
    return std::any_of(m.stop.begin(), m.stop.end(), [id](const stop_t& s) { return s.id == id; });
  };
  pending_.erase(std::remove_if(pending_.begin(), pending_.end(),
                                [now](const Pending& p) { return now >= p.until; }),
                 pending_.end());
  for (auto stop = in_force_.begin(); stop != in_force_.end();) {
    const auto& [id, s] = *stop;
    if (lists(id) || !at_rest || !has_release_of(id, s)) {
      ++stop;
      continue;
    }
    released_.insert(id);
    ++releases_;
    stop = in_force_.erase(stop);
  }
  lost_.clear();
  for (auto& [id, stop] : in_force_) {
    if (stop.listed && !lists(id)) lost_.push_back(id);
  }
  for (const stop_t& s : m.stop) {
    Stop& stop = in_force_.emplace(s.id, Stop{s.issuer}).first->second;
    stop.listed = true;
    stop.persisted = stop.persisted || m.emergency_stop == status_t::STOP_PERSISTED;
  }
}

}  // namespace rcs::bg::test
