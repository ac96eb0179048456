#include "rcs/node/bus/channel_owner.h"

#include <algorithm>

#include "lcmtypes/channels.h"

namespace rcs {

ChannelOwner::Verdict ChannelOwner::judge(const Publisher& from, Stamp arrival) const {
  if (rule_ == Rule::kAnyone) return Verdict::kAccepted;
  if (rule_ != Rule::kOne && from.run_id != run_id_) return Verdict::kOtherRun;
  if (rule_ == Rule::kRun || received_ == Stamp::min()) return Verdict::kAccepted;
  return is(from) || arrival - received_ > silence() ? Verdict::kAccepted : Verdict::kSecond;
}

bool ChannelOwner::accept(const Publisher& from, Stamp arrival) {
  const bool same = is(from);
  const Duration since = received_ == Stamp::min() ? Duration::zero() : arrival - received_;
  if (same) {
    constexpr int kLowPass = 8;
    interval_ = interval_ == Duration::zero() ? since : interval_ + (since - interval_) / kLowPass;
  } else {
    interval_ = Duration::zero();
  }
  const bool changed = !same && received_ != Stamp::min();
  owner_ = from;
  received_ = arrival;
  return changed;
}

// Short enough for a node that is killed and started again; a source that publishes once a second
// may miss one message.
Duration ChannelOwner::silence() const {
  constexpr Duration kUnknown = from_seconds(1.0);
  constexpr Duration kShortest = from_milliseconds(100.0);
  constexpr Duration kLongest = from_seconds(3.0);
  if (interval_ == Duration::zero()) return kUnknown;
  return std::clamp(interval_ * 5 / 2, kShortest, kLongest);
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
