#include "modules/ros2_bridge/input_gate.h"

#include <algorithm>
#include <cstdlib>

namespace rcs::ros2_bridge {
namespace {

Publisher publisher_of(std::uint64_t handle) {
  return {0, static_cast<std::int64_t>(handle >> 1U)};  // ids are not negative
}

}  // namespace

std::string_view name_of(InputVerdict verdict) {
  switch (verdict) {
    case InputVerdict::kAccepted:
      return "accepted";
    case InputVerdict::kRestarted:
      return "restarted";
    case InputVerdict::kSecondPublisher:
      return "a second publisher uses the topic";
    case InputVerdict::kTooFast:
      return "rate above max_rate_hz";
    case InputVerdict::kStampAhead:
      return "stamp in the future";
    case InputVerdict::kStampOld:
      return "stamp older than max_age_ms";
    case InputVerdict::kStampNotLater:
      return "stamp not later than the last one";
  }
  return "unknown";
}

InputGate::InputGate(double max_rate_hz, const StampLimits& limits)
    : limits_(limits),
      rate_hz_(max_rate_hz),
      max_tokens_(std::max(2.0, 0.25 * max_rate_hz)),
      tokens_(max_tokens_) {}

InputVerdict InputGate::judge_arrival(std::uint64_t publisher, Stamp now) {
  if (owner_.judge(publisher_of(publisher), now) != ChannelOwner::Verdict::kAccepted) {
    return InputVerdict::kSecondPublisher;
  }
  if (refilled_ != Stamp::min()) {
    tokens_ = std::min(max_tokens_, tokens_ + rate_hz_ * seconds(now - refilled_));
  }
  refilled_ = now;
  if (tokens_ < 1.0) return InputVerdict::kTooFast;
  tokens_ -= 1.0;
  return InputVerdict::kAccepted;
}

InputVerdict InputGate::judge_stamp(std::uint64_t publisher, std::int64_t stamp_us,
                                    std::int64_t present_us, Stamp now) {
  if (stamp_us - present_us > limits_.max_ahead.count()) return InputVerdict::kStampAhead;
  if (present_us - stamp_us > limits_.max_age.count()) return InputVerdict::kStampOld;
  InputVerdict verdict = InputVerdict::kAccepted;
  if (last_us_ && stamp_us <= *last_us_) {
    if (!back_since_ || stamp_us <= back_us_) back_since_ = now;
    back_us_ = stamp_us;
    if (now - *back_since_ < limits_.restart_after) return InputVerdict::kStampNotLater;
    verdict = InputVerdict::kRestarted;
  }
  last_us_ = stamp_us;
  back_since_.reset();
  (void)owner_.accept(publisher_of(publisher), now);
  return verdict;
}

Duration UtcOffset::add(std::int64_t utc_us, Stamp now) {
  const std::int64_t reading_us = utc_us - to_utime(now);
  if (!offset_us_) {
    offset_us_ = min_us_ = reading_us;
    return Duration::zero();
  }
  min_us_ = readings_ == 0 ? reading_us : std::min(min_us_, reading_us);
  ++readings_;
  const std::int64_t before_us = *offset_us_;
  // No reading is too small: a smaller one is true at once. A larger one may be late.
  if (reading_us < before_us) offset_us_ = reading_us;
  if (readings_ == kWindow) {
    offset_us_ = min_us_;
    readings_ = 0;
  }
  const Duration step(*offset_us_ - before_us);
  return std::abs(step.count()) > kStep.count() ? step : Duration::zero();
}

}  // namespace rcs::ros2_bridge
