#include "modules/gateway/operator_stops.h"

#include <algorithm>
#include <utility>

namespace rcs::gateway {

OperatorStops::Entry* OperatorStops::find(std::string_view operator_id) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.stop.operator_id == operator_id;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void OperatorStops::adopt(std::string_view operator_id) {
  Entry* const entry = find(operator_id);
  if (entry == nullptr) {
    entries_.push_back({{std::string(operator_id), 0}, Stamp::min(), true, true});
  } else if (!entry->sent) {
    *entry = {{entry->stop.operator_id, 0}, entry->pressed, true, true};
  }
}

void OperatorStops::press(std::string_view operator_id, Stamp now) {
  Entry* entry = find(operator_id);
  if (entry == nullptr) {
    entries_.push_back({{std::string(operator_id), ++newest_}, now, false, false});
    entry = &entries_.back();
  }
  entry->pressed = now;
}

std::optional<OperatorStops::Stop> OperatorStops::update(
    const std::vector<std::string_view>& engaged, Stamp now, const IsListed& is_listed,
    bool refresh) {
  const auto is_engaged = [&engaged](const Entry& e) {
    return std::find(engaged.begin(), engaged.end(), e.stop.operator_id) != engaged.end();
  };
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                [&](const Entry& e) { return !is_engaged(e); }),
                 entries_.end());
  for (const std::string_view name : engaged) {
    if (find(name) == nullptr) {
      entries_.push_back({{std::string(name), ++newest_}, now, false, false});
    }
  }
  const Entry* missing = nullptr;
  for (Entry& e : entries_) {
    const bool listed = is_listed(e.stop);
    // BG ignores repetitions of a stop that an authority has released.
    if (e.listed && !listed && e.pressed != Stamp::min() && now - e.pressed <= kAgain) {
      e = {{e.stop.operator_id, ++newest_}, e.pressed, false, false};
    } else if (e.listed && !listed && e.stop.number == 0) {
      ended_.push_back(e.stop.operator_id);
    }
    e.listed = e.listed || listed;
    const bool waits = !listed && e.stop.number != 0;
    if (waits && (missing == nullptr || (missing->sent && !e.sent))) missing = &e;
  }
  if (missing != nullptr && (!missing->sent || refresh)) {
    const Stop stop = missing->stop;
    find(stop.operator_id)->sent = true;
    return stop;
  }
  if (!refresh || entries_.empty() || entries_.back().stop.number == 0) return std::nullopt;
  return entries_.back().stop;
}

}  // namespace rcs::gateway
