#pragma once
// Poses of WM by their stamps, for the pose at the stamp of a scan.

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "rcs/base/pose.h"

namespace rcs::view {

class PoseHistory {
 public:
  explicit PoseHistory(std::int64_t span_us) : span_us_(span_us) {}

  /// Adds the pose of an encoded WM_NAV_STATE, if it is valid.
  void add_nav_state(const std::uint8_t* data, std::size_t size);
  /// T_world_vehicle at a stamp of sensor time, interpolated; before the first and after the last
  /// stamp the nearest one. nullopt: no poses
  [[nodiscard]] std::optional<Pose> at(std::int64_t utime) const;

 private:
  std::int64_t span_us_;
  std::deque<std::pair<std::int64_t, Pose>> poses_;  // by stamp, ascending
};

}  // namespace rcs::view
