#include "rcs/node/stop_receiver.h"

#include <algorithm>
#include <new>
#include <utility>

#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/publisher.h"

namespace rcs {

std::int64_t stop_id_of(const command_t& stop) {
  if (stop.n_stops == 1 && stop.stop_id.size() == 1 && stop.stop_id[0] != 0) return stop.stop_id[0];
  const std::int64_t id = id_of(stop.issuer, id_of(stop.issuer, stop.serial) ^ stop.utime);
  return std::max<std::int64_t>(id, 1);
}

StopReceiver::StopReceiver(Bus* bus, std::string_view stop_channel,
                           std::string_view command_channel) {
  arrived_.reserve(kMaxArrived + 1);
  taken_.reserve(kMaxArrived + 1);
  bus->subscribe(stop_channel, this);
  bus->subscribe(command_channel, this);
}

void StopReceiver::receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept {
  try {
    if (size > kMaxEncodedBytes<command_t>) return;
    if (scratch_.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) return;
    if (scratch_.kind == command_t::KIND_EMERGENCY_STOP) accept(arrival);
  } catch (const std::bad_alloc&) {
    return;  // the command inbox counts malformed messages
  }
}

void StopReceiver::accept(Stamp arrival) {
  if (scratch_.issuer.size() > kMaxIssuer) scratch_.issuer.resize(kMaxIssuer);
  const std::int64_t id = stop_id_of(scratch_);
  const Record* const known = find(id);
  if (known != nullptr && known->released) return;
  const bool copy = known != nullptr;
  const bool listed =
      std::any_of(arrived_.begin(), arrived_.end(), [id](const stop_t& s) { return s.id == id; });
  if (!listed && arrived_.size() < kMaxArrived) {
    arrived_.push_back({id, scratch_.issuer});
  } else if (!listed && !copy && arrived_.size() == kMaxArrived) {
    arrived_.emplace_back();  // one stop without a name for all others
  }
  if (!copy) {
    note(id, false);
    last_arrival_ = std::max(last_arrival_, arrival);
  }
  // A copy must not displace a new stop.
  if (pending_ && copy && pending_new_) return;
  std::swap(newest_, scratch_);
  pending_ = true;
  pending_new_ = pending_new_ || !copy;
}

const command_t* StopReceiver::take() {
  std::swap(taken_, arrived_);
  arrived_.clear();
  if (!pending_) return nullptr;
  std::swap(taken_command_, newest_);
  took_new_ = pending_new_;
  pending_ = pending_new_ = false;
  return &taken_command_;
}

void StopReceiver::release(const std::vector<std::int64_t>& ids) {
  for (const std::int64_t id : ids) {
    if (id == 0) continue;
    if (Record* const known = find(id)) {
      known->released = true;
    } else {
      note(id, true);
    }
  }
}

void StopReceiver::note(std::int64_t id, bool released) {
  records_[next_record_] = {id, released};
  next_record_ = (next_record_ + 1) % records_.size();
}

StopReceiver::Record* StopReceiver::find(std::int64_t id) {
  Record* const found =
      std::find_if(records_.begin(), records_.end(), [id](const Record& r) { return r.id == id; });
  return found == records_.end() ? nullptr : found;
}

}  // namespace rcs
