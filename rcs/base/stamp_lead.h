#pragma once
// Lead of the stamps of a source over other times: their arrivals, or the stamps of another source.
// The two are never subtracted from each other (ADR 1), only their advances are compared.

#include <algorithm>
#include <optional>

#include "rcs/base/stamp.h"

namespace rcs {

/// Since the first message. The largest lead is that of the smallest latency.
struct StampLead {
  Stamp stamp = Stamp::min();  ///< newest
  Stamp other = Stamp::min();  ///< the other time of the newest
  Duration lead{};
  Duration best{};  ///< largest usual lead
  int count = 0;    ///< messages

  void add(Stamp s, Stamp o) {
    if (count > 0) lead += (s - stamp) - (o - other);
    stamp = s;
    other = o;
    ++count;
  }
  /// @param most  by which the largest lead may grow now: a clock that has stepped must not become
  ///   the reference before the step is detected. None: by anything
  void follow(std::optional<Duration> most) {
    best = std::max(best, most ? std::min(lead, best + *most) : lead);
  }
};

}  // namespace rcs
