#include "modules/ros2_bridge/output_budget.h"

#include <algorithm>

namespace rcs::ros2_bridge {

bool Decimator::admit(Stamp now) {
  if (now < next_) return false;
  const bool continued = next_ != Stamp::min() && now - next_ < period_;
  next_ = (continued ? next_ : now) + period_;
  return true;
}

ByteBudget::Verdict ByteBudget::take(std::size_t bytes, Stamp now) {
  const std::size_t usable = bytes <= kSmallBytes ? max_bytes_ : max_bytes_ / 5 * 4;
  if (bytes > usable) return Verdict::kTooLarge;
  const std::int64_t slot = now.time_since_epoch() / kSlot;
  const std::int64_t passed =
      std::min(slot - slot_, static_cast<std::int64_t>(kSlots));  // slots to be emptied
  for (std::int64_t i = 0; i < passed; ++i) {
    std::size_t& oldest = granted_[static_cast<std::size_t>(slot - i) % kSlots];
    sum_ -= oldest;
    oldest = 0;
  }
  slot_ = std::max(slot, slot_);
  if (sum_ + bytes > usable) return Verdict::kExhausted;
  granted_[static_cast<std::size_t>(slot_) % kSlots] += bytes;
  sum_ += bytes;
  return Verdict::kGranted;
}

}  // namespace rcs::ros2_bridge
