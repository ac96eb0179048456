#include "tests/live_faults/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rcs::live_faults {
namespace {

/// Work units in a second on a quiet computer, and the longest gap that is not a silence.
struct Rate {
  const char* node;
  double normal_hz;
  Duration silence;
};
const Rate kRates[] = {{"sp", 10.0, from_seconds(0.35)},
                       {"wm", 50.0, from_seconds(0.2)},
                       {"bg", 20.0, from_seconds(0.25)},
                       {"gateway", 20.0, from_seconds(0.25)}};
constexpr double kShareOfRate = 0.7;
constexpr Duration kFresh = from_seconds(0.25);

}  // namespace

void Recovery::take(const cycle_t& m, Stamp arrival) {
  std::deque<Stamp>& received = cycles_[m.node];
  received.push_back(arrival);
  while (received.front() < arrival - kHeld) received.pop_front();
}

void Recovery::take(const nav_state_t& m, Stamp arrival) {
  nav_ = m;
  nav_arrival_ = arrival;
}

void Recovery::take(const status_t& m, Stamp arrival) {
  status_ = m;
  status_arrival_ = arrival;
}

std::string Recovery::what_is_missing(Stamp now, double speed_mps) const {
  for (const Rate& r : kRates) {
    const auto received = cycles_.find(r.node);
    if (received == cycles_.end() || now - received->second.back() > r.silence) {
      return fmt::format("{} is silent", r.node);
    }
  }
  if (!nav_ || now - nav_arrival_ > kFresh) return "WM_NAV_STATE is silent";
  if (nav_->mode == nav_state_t::MODE_ALIGN || nav_->mode == nav_state_t::MODE_LOST) {
    return fmt::format("WM is in mode {}", nav_->mode);
  }
  if (nav_->world_valid == 0) return "WM has no world";
  if (nav_->rolling_valid == 0) return "WM has no map";
  if (!status_ || now - status_arrival_ > kFresh) return "BG_STATUS is silent";
  if (status_->state.rfind("DRIVING", 0) != 0) return "BG is " + status_->state;
  if (speed_mps < kDriving_mps) return fmt::format("the vehicle has {:.2f} m/s", speed_mps);
  return "";
}

void Recovery::look(Stamp now, double speed_mps) {
  missing_ = what_is_missing(now, speed_mps);
  if (!missing_.empty()) {
    well_since_.reset();
    return;
  }
  if (!well_since_) well_since_ = now;
  if (recovered_ || now - *well_since_ < kHeld) return;
  for (const Rate& r : kRates) {
    const std::deque<Stamp>& received = cycles_[r.node];
    const auto in_second =
        std::count_if(received.begin(), received.end(), [&](Stamp s) { return s >= now - kHeld; });
    if (static_cast<double>(in_second) >= kShareOfRate * r.normal_hz) continue;
    missing_ = fmt::format("{} works {} times a second", r.node, in_second);
    return;
  }
  recovered_ = well_since_;
}

}  // namespace rcs::live_faults
