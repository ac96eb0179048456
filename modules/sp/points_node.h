#pragma once
// Publishes SP's points for WM's terrain: thinned, in datagrams.

#include <cstddef>
#include <cstdint>

#include "lcmtypes/rcs/points_t.hpp"
#include "modules/registration/voxel_sampler.h"
#include "rcs/base/pose.h"
#include "rcs/node/bus/outbox.h"

namespace rcs::sp {

class PointsWriter {
 public:
  explicit PointsWriter(Bus* bus);

  /// Allocates room for scans of `points` points in advance.
  void reserve(std::size_t points);

  /// @param scan  vehicle frame [m]
  /// @param voxel_m  one point of each voxel is published
  /// @param utime, scan_id, map_epoch  of the scan and of the map that it was registered to
  void publish(const Points& scan, double voxel_m, const Pose& T_rolling_vehicle,
               std::int64_t utime, std::int64_t scan_id, std::int32_t map_epoch);

 private:
  Outbox<points_t> out_;
  registration::VoxelSampler sampler_;
  Points thinned_;
  points_t message_{};
};

}  // namespace rcs::sp
