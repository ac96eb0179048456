#pragma once
// Names what the alignment lacks when it takes longer than usual.

#include <optional>

#include "rcs/base/stamp.h"

namespace rcs::wm {

enum class Missing { kLevel, kPosition, kHeading };

class AlignmentWatch {
 public:
  static constexpr Duration kPatience = from_seconds(8.0);

  /// @param missing  at `now`, node time; none: aligned, or nothing is received
  /// @return what has been missing for kPatience, once
  std::optional<Missing> add(Stamp now, std::optional<Missing> missing) {
    if (missing != missing_) {
      missing_ = missing;
      since_ = now;
      reported_ = false;
    }
    if (!missing_ || reported_ || now - since_ < kPatience) return std::nullopt;
    reported_ = true;
    return missing_;
  }

 private:
  std::optional<Missing> missing_;
  Stamp since_ = Stamp::min();
  bool reported_ = false;
};

}  // namespace rcs::wm
