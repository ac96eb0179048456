#include "modules/wm/clock_watch.h"

#include <algorithm>

namespace rcs::wm {
namespace {

constexpr int kEnough = 3;  // messages in a row for or against a presumed step

}  // namespace

void ClockWatch::Track::add(Stamp s, Stamp arrival, bool follows) {
  // Oscillators differ by up to 100 ppm: the largest lead of an hour ago says nothing now.
  constexpr Duration::rep kDrift = 10'000;
  if (count > 0) since_drift += std::max(Duration::zero(), arrival - other);
  best -= since_drift / kDrift;
  since_drift %= kDrift;
  StampLead::add(s, arrival);
  if (!follows) return;
  constexpr Duration kMax = from_milliseconds(5.0);
  follow(count <= kKnown ? std::nullopt : std::optional<Duration>(kMax));
}

bool ClockWatch::Track::alive(Stamp now) const {
  return count >= kKnown && now - other < from_seconds(1.0);
}

bool ClockWatch::Track::moved_by(Duration step) const {
  const Duration gained = lead - best;
  return step > Duration::zero() ? gained * 2 > step : gained * 2 < step;
}

namespace {

bool same_increments(const ImuSample& a, const ImuSample& b) {
  return a.delta_angle == b.delta_angle && a.delta_v == b.delta_v;
}

}  // namespace

void ClockWatch::Recent::add(const ImuSample& imu) { samples_[count_++ % samples_.size()] = imu; }

bool ClockWatch::Recent::has(const ImuSample& imu) const {
  const std::size_t n = std::min(count_, samples_.size());
  bool found = false;
  bool others = false;
  for (std::size_t k = 0; k < n; ++k) {
    const bool same = same_increments(samples_[k], imu);
    found = found || (same && samples_[k].stamp == imu.stamp);
    others = others || !same;
  }
  return found && others;
}

bool ClockWatch::Recent::lacks(Stamp stamp, Duration within) const {
  const std::size_t n = std::min(count_, samples_.size());
  bool older = false;
  for (std::size_t k = 0; k < n; ++k) {
    const Duration ahead = samples_[k].stamp - stamp;
    if (ahead <= within && -ahead <= within) return false;
    older = older || ahead < Duration::zero();
  }
  return older;
}

ClockWatch::Verdict ClockWatch::add(const ImuSample& imu, Stamp arrival) {
  // A driver that sends its samples twice must not hide a step: the first copies are of the old
  // clock. One that repeats a single sample for ever is no such driver.
  const auto is_copy = [&imu](const ImuSample& held) {
    return held.stamp == imu.stamp && same_increments(held, imu);
  };
  if (recent_.has(imu) || (held_.size() > 1 && std::any_of(held_.begin(), held_.end(), is_copy))) {
    return Verdict::kRepeated;
  }
  if (suspected_) {
    const bool continues = imu.stamp > held_.back().stamp &&
                           imu.stamp - held_.back().stamp <= 5 * imu.interval + kForward;
    const bool returns = imu.stamp > ins_.stamp;
    const bool room = held_.size() < kMaxHeld;
    // Disorder ends before the INS has repeated its time for long.
    const bool repeats = step_ < Duration::zero() && imu.stamp <= ins_.stamp;
    if (continues && room && (step_ > Duration::zero() || repeats || established())) {
      held_.push_back(imu);
      last_held_arrival_ = arrival;
      return Verdict::kHeld;
    }
    // A single stamp from the future is dropped; samples that are only out of order are kept.
    suspected_ = false;
    if (step_ > Duration::zero() || !returns) {
      if (repeats) disorder_ = std::max(disorder_, held_.back().stamp);
      held_.clear();
      dropped_ = true;
    }
  }
  if (ins_.count == 0 || imu.stamp == ins_.stamp) {
    if (ins_.count == 0) {
      ins_.add(imu.stamp, arrival, true);
      recent_.add(imu);
    }
    return Verdict::kPass;
  }
  const Duration passed = imu.stamp - ins_.stamp;
  const Duration waited = arrival - ins_.other;
  const bool known = ins_.count >= kKnown;
  // After a silence, the advance of a log that is replayed at another speed is not a step. A lower
  // lead is a delay: when it ends, the stamps gain on the arrivals without a step.
  const bool silence = waited > 3 * imu.interval + from_milliseconds(20.0);
  const Duration gained = ins_.lead + passed - waited - ins_.best;
  const bool forward = known && !silence && gained > kForward && passed > imu.interval + kForward;
  // A stuck driver repeats an old sample for ever: it must not hold the samples of the others.
  const bool backward = known && passed * 2 <= -imu.interval && imu.stamp > disorder_ &&
                        !recent_.lacks(imu.stamp, imu.interval / 2);
  if (!forward && !backward) {
    recent_.add(imu);
    if (passed < Duration::zero()) return Verdict::kPass;
    ins_.add(imu.stamp, arrival, true);
    if (silence) ins_.best = std::max(ins_.best, ins_.lead);
    return Verdict::kPass;
  }
  suspected_ = true;
  const auto intervals = std::max<Duration::rep>(1, (waited + imu.interval / 2) / imu.interval);
  step_ = passed - std::min<Duration::rep>(intervals, 4) * imu.interval;
  suspected_at_ = last_held_arrival_ = arrival;
  held_.push_back(imu);
  return Verdict::kHeld;
}

bool ClockWatch::add(Clock clock, Stamp stamp, Stamp arrival) {
  if (arrival == Stamp::min()) return true;
  Track& track = others_[static_cast<std::size_t>(clock)];
  const bool silence = track.count > 0 && arrival - track.other > from_seconds(2.0);
  const bool judges = presumed_ != Duration::zero() && track.judges;
  // A stuck driver does not show its clock.
  if (stamp != track.stamp) {
    track.add(stamp, arrival, !judges);
    if (judges) check_presumed(track);
  }
  if (silence && !judges) track.best = track.lead;
  if (arrival < unsettled_until_) return false;
  // If only the clock of the INS has stepped, or none has, the inputs of the others are right.
  return !suspected_ || (track.known() && !silence && !track.moved_by(step_));
}

/// Counts whether a source, whose latency was known before, has stepped by what is presumed of all.
void ClockWatch::check_presumed(const Track& track) {
  const Duration gained = track.lead - track.best;
  const auto near = [this](Duration d) { return abs(d) * 4 < abs(presumed_); };
  for_ = near(gained) ? for_ + 1 : 0;
  against_ = near(gained + presumed_) ? against_ + 1 : 0;
  if (for_ < kEnough) return;
  presumed_ = {};
  against_ = 0;
}

/// The presumed step was that of the INS alone.
ClockStep ClockWatch::take_back() {
  for (Track& track : others_) {
    if (track.judges) {
      track.best -= presumed_;
    } else {
      track = {};
    }
  }
  ins_shift_ -= presumed_;
  const ClockStep back{-presumed_, true};
  presumed_ = {};
  against_ = 0;
  return back;
}

/// @return nullopt if nothing has been received that was certainly measured after the suspected
///   step
std::optional<bool> ClockWatch::has_stepped(Clock clock, Stamp now) const {
  const Track& track = others_[static_cast<std::size_t>(clock)];
  const Duration latency = clock == Clock::kOdometry ? from_milliseconds(20.0)
                           : clock == Clock::kGps    ? from_milliseconds(100.0)
                                                     : from_milliseconds(200.0);
  if (!track.alive(now) || track.other - suspected_at_ < latency) return std::nullopt;
  return track.moved_by(step_);
}

/// More than one stamp supports the suspected step.
bool ClockWatch::established() const {
  if (step_ > Duration::zero()) return held_.size() > 1;
  const Duration span = held_.back().stamp - held_.front().stamp;
  return span >= kBackward && (last_held_arrival_ - suspected_at_) * 2 >= span;
}

std::optional<ClockStep> ClockWatch::resolve(Stamp now) {
  if (!suspected_ && against_ >= kEnough) return take_back();
  if (!suspected_) return std::nullopt;
  const Duration waited = now - suspected_at_;
  if (!established()) {
    // The INS has fallen silent since.
    if (now - last_held_arrival_ > kPatience) {
      suspected_ = false;
      held_.clear();
      dropped_ = true;
    }
    return std::nullopt;
  }
  std::optional<bool> all = has_stepped(Clock::kOdometry, now);
  if (!all) all = has_stepped(Clock::kGps, now);
  if (!all && waited <= kPatience) return std::nullopt;
  if (!all) all = has_stepped(Clock::kLadar, now);
  // A clock of the INS that returns.
  const Duration remains = ins_shift_ - step_;
  const bool returns = ins_shift_ != Duration::zero() && remains < kForward && -remains < kForward;
  const ClockStep step{step_, all.value_or(!returns)};
  settle(step, now);
  presumed_ = !all && step.of_all ? step.step : Duration::zero();
  for_ = against_ = 0;
  return step;
}

void ClockWatch::settle(const ClockStep& step, Stamp now) {
  suspected_ = false;
  recent_ = {};
  for (const ImuSample& held : held_) recent_.add(held);
  ins_.stamp = held_.back().stamp;
  ins_.other = last_held_arrival_;
  ins_.best += step.step;
  ins_.lead = ins_.best;
  disorder_ = Stamp::min();
  if (!step.of_all) {
    ins_shift_ -= step.step;
    return;
  }
  for (Track& track : others_) {
    track.judges = track.known();
    if (track.judges) {
      track.best += step.step;
    } else {
      track = {};  // its latency is learned again
    }
  }
  unsettled_until_ = now + kSettling;
}

}  // namespace rcs::wm
