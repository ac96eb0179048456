#include "rcs/node/bus/channel_owner.h"

#include <algorithm>

#include "lcmtypes/channels.h"

namespace rcs {

// A publisher of another run never becomes the owner, so its messages delay no successor.
ChannelOwner::Verdict ChannelOwner::judge(const Publisher& from, Stamp arrival) {
  if (rule_ == Rule::kAnyone) return Verdict::kAccepted;
  if (rule_ != Rule::kOne && from.run_id != run_id_) return Verdict::kOtherRun;
  if (rule_ == Rule::kRun || !known()) return Verdict::kAccepted;
  if (is(from) || may_follow(arrival)) return Verdict::kAccepted;
  second_waits_ = true;
  return Verdict::kSecond;
}

// The messages of a successor come after all those of its predecessor: a driver that is back sooner
// than silence() is rejected until then, and not for longer.
bool ChannelOwner::may_follow(Stamp arrival) const {
  const Duration silent = arrival - received_;
  if (silent >= kContested) return true;
  const bool contested = contested_ != Stamp::min() && arrival - contested_ < kContested;
  return !contested && silent > silence();
}

bool ChannelOwner::accept(const Publisher& from, Stamp arrival) {
  const bool same = is(from);
  const Duration since = known() ? arrival - received_ : Duration::zero();
  if (same) {
    constexpr int kLowPass = 8;
    interval_ = interval_ == Duration::zero() ? since : interval_ + (since - interval_) / kLowPass;
    if (second_waits_) contested_ = arrival;
  } else {
    interval_ = Duration::zero();
    contested_ = Stamp::min();
  }
  second_waits_ = false;
  const bool changed = !same && known();
  owner_ = from;
  received_ = arrival;
  return changed;
}

// Short enough for a node that is killed and started again; a source that publishes once a second
// may miss one message.
Duration ChannelOwner::silence() const {
  constexpr Duration kUnknown = from_seconds(1.0);
  constexpr Duration kShortest = from_milliseconds(100.0);
  if (interval_ == Duration::zero()) return kUnknown;
  return std::clamp(interval_ * 5 / 2, kShortest, kContested);
}

ChannelOwner::Rule ownership_of(std::string_view channel) {
  for (const channel::Info& info : channel::kAll) {
    if (channel != info.name) continue;
    switch (info.kind) {
      case channel::Kind::kSensor:
        return ChannelOwner::Rule::kOne;
      case channel::Kind::kOutput:
        return ChannelOwner::Rule::kOneOfTheRun;
      case channel::Kind::kAccount:
        return ChannelOwner::Rule::kRun;
      case channel::Kind::kCommand:
      case channel::Kind::kTruth:
        return ChannelOwner::Rule::kAnyone;
    }
  }
  return ChannelOwner::Rule::kAnyone;
}

}  // namespace rcs
