#include "tools/view/source/pose_history.h"

#include <algorithm>
#include <iterator>

#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"
#include "lcmtypes/rcs/nav_state_t.hpp"

namespace rcs::view {

void PoseHistory::add_nav_state(const std::uint8_t* data, std::size_t size) {
  nav_state_t nav{};
  const int bytes = static_cast<int>(size);
  Pose T_world_vehicle;
  if (nav.decode(data, 0, bytes) != bytes || nav.pose_valid == 0 || !plausible_motion(nav) ||
      !from_message(nav.q_world_vehicle, nav.p_world_vehicle_m, &T_world_vehicle)) {
    return;
  }
  // Of equal stamps the newest; a clock that stepped back begins again.
  while (!poses_.empty() && poses_.back().first >= nav.utime) poses_.pop_back();
  poses_.emplace_back(nav.utime, T_world_vehicle);
  while (poses_.front().first < nav.utime - span_us_) poses_.pop_front();
}

std::optional<Pose> PoseHistory::at(std::int64_t utime) const {
  if (poses_.empty()) return std::nullopt;
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), utime,
                       [](const auto& entry, std::int64_t t) { return entry.first < t; });
  if (after == poses_.end()) return poses_.back().second;
  if (after == poses_.begin() || after->first == utime) return after->second;
  const auto before = std::prev(after);
  const double share = static_cast<double>(utime - before->first) /
                       static_cast<double>(after->first - before->first);
  return interpolate(before->second, after->second, share);
}

}  // namespace rcs::view
