#pragma once
// Whether the scans in the terrain are of now.

#include <algorithm>

#include "rcs/base/stamp.h"

namespace rcs::bg {

enum class Scans {
  kNew,   ///< a recent scan that the terrain did not contain before
  kNone,  ///< no other scan than before
  kLost,  ///< no other scan than before for longer than scans are apart
};

class ScanWatch {
 public:
  /// @param scan  reference instant of the newest scan in the terrain
  /// @param now  sensor time
  Scans update(Stamp scan, Stamp now) {
    // A step back is another log or another simulation.
    const bool is_new = scan != newest_;
    if (is_new) {
      const Duration since = newest_ == Stamp::min() ? Duration(0) : scan - newest_;
      if (since > Duration(0) && since < kLongest) interval_ = since;
      newest_ = scan;
      return now - scan < kRecent ? Scans::kNew : Scans::kNone;
    }
    return now - scan >= std::max(kRecent, interval_ + interval_ / 2) ? Scans::kLost : Scans::kNone;
  }

 private:
  // An older scan was made at another place: it does not show what is hidden from here.
  static constexpr Duration kRecent = from_seconds(0.3);
  static constexpr Duration kLongest = from_seconds(1.0);  // interval; a longer one is a loss
  Stamp newest_ = Stamp::min();
  Duration interval_{};
};

}  // namespace rcs::bg
