#include "modules/wm/input_watch.h"

#include <algorithm>

namespace rcs::wm {
namespace {

constexpr Duration kShortest = from_milliseconds(200.0);
constexpr Duration kUnknownPeriod = from_seconds(1.0);  // of an input that was received once

}  // namespace

void InputWatch::add(Input input, Stamp stamp, Stamp arrival) {
  Arrivals& a = arrivals_[static_cast<std::size_t>(input)];
  if (a.stamp != Stamp::min() && stamp > a.stamp) {
    const Duration interval = stamp - a.stamp;
    // A gap must not be mistaken for a period.
    a.period = a.period == Duration::zero()
                   ? std::min(interval, kUnknownPeriod)
                   : a.period + (std::min(interval, 2 * a.period) - a.period) / 8;
  }
  a.stamp = stamp;
  a.arrival = std::max(a.arrival, arrival);
}

void InputWatch::add_newer(Input input, Stamp stamp, Stamp arrival) {
  constexpr Duration kStepped = from_seconds(2.0);
  const Stamp newest = of(input).stamp;
  if (newest == Stamp::min() || stamp > newest || newest - stamp > kStepped) {
    add(input, stamp, arrival);
  }
}

Duration InputWatch::silence(Input input, Stamp now) const {
  const Stamp arrival = of(input).arrival;
  return arrival == Stamp::min() ? Duration(-1) : std::max(now - arrival, Duration::zero());
}

Duration InputWatch::limit(Input input) const {
  const Duration period = of(input).period;
  return std::max(kShortest, 3 * (period == Duration::zero() ? kUnknownPeriod : period));
}

bool InputWatch::silent(Input input, Stamp now) const { return silence(input, now) > limit(input); }

Duration InputWatch::all_silent_for(Stamp now) const {
  constexpr Input kMoving[] = {Input::kIns, Input::kGps, Input::kLadar};
  Stamp newest = Stamp::min();
  for (const Input input : kMoving) newest = std::max(newest, of(input).arrival);
  if (newest == Stamp::min()) return Duration(-1);
  // The fastest of the sources that were active until then is missed first.
  Duration shortest = Duration::max();
  for (const Input input : kMoving) {
    const bool there =
        of(input).arrival != Stamp::min() && newest - of(input).arrival <= limit(input);
    if (there) shortest = std::min(shortest, limit(input));
  }
  return now - newest - shortest;
}

}  // namespace rcs::wm
