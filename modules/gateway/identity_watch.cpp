#include "modules/gateway/identity_watch.h"

namespace rcs::gateway {

IdentityWatch::State IdentityWatch::state(std::int64_t wall_utime) const {
  if (wall_utime >= end_utime_) return State::kExpired;
  return Duration(end_utime_ - wall_utime) <= kSoon ? State::kEndsSoon : State::kValid;
}

int IdentityWatch::days_left(std::int64_t wall_utime) const {
  return static_cast<int>((end_utime_ - wall_utime) / 86'400'000'000);
}

bool IdentityWatch::take_due(std::int64_t wall_utime, Stamp now) {
  const State current = state(wall_utime);
  const bool worse = current > reported_;
  const bool again =
      current != State::kValid && current == reported_ && now - reported_at_ >= kRepeat;
  reported_ = current;
  if (worse || again) reported_at_ = now;
  return worse || again;
}

}  // namespace rcs::gateway
