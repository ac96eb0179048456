#pragma once
// Voxels that suit what the LADAR sees: in a room a voxel of half a metre contains the edges of the
// furniture, and its surface is none; a registration then finds poses decimetres off, with a claim
// of centimetres. Pure, so that a replay chooses the same.

#include <vector>

#include "rcs/base/points.h"

namespace rcs::sp {

/// Median distance of the points from the LADAR [m], of at most some thousand of them; 0: there is
/// no point.
/// @param buffer  for the distances
[[nodiscard]] double median_range_m(const Points& points, const Vec3& ladar_m,
                                    std::vector<float>* buffer);

/// Edge of the fine voxels that suits a place.
[[nodiscard]] double fitting_voxel_m(double median_range_m);

/// Factor on all configured voxels, (0, 1].
/// @param voxel_m  configured edge of the fine voxels of the rolling map
/// @param noise_m  sigma of a surface; a voxel of less than some of it has no normal
[[nodiscard]] double fitting_scale(double median_range_m, double voxel_m, double noise_m);

/// The scale of the present map, and whether another one suits better for long.
class VoxelScale {
 public:
  [[nodiscard]] double now() const { return scale_; }
  void begin(double scale) {
    scale_ = scale;
    unfit_ = 0;
  }
  /// Call it for each scan.
  /// @return the present scale has been wrong by a factor of two or more for 20 scans in a row
  [[nodiscard]] bool unsuitable(double fitting);

 private:
  double scale_ = 1.0;
  int unfit_ = 0;  // scans in a row
};

}  // namespace rcs::sp
