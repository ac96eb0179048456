#pragma once
// Coarse map of normal distributions by voxel (NDT: Magnusson 2009), for registration with a large
// initial error.

#include <array>
#include <vector>

#include "modules/registration/point_moments.h"
#include "modules/registration/rolling_map.h"
#include "modules/registration/voxel_index.h"

namespace rcs::registration {

struct WideMapParams {
  double range_sigma_m = 0.03;  ///< added to every distribution, [0.001, 1]
  /// Smallest over largest variance of a distribution: determines the distance from which a point
  /// is drawn to the surface, [0.001, 1]. Chosen on frames 5, 15, 25, ... of the KITTI drive.
  double flatness = 0.2;
};

/// Constant after construction.
class WideMap {
 public:
  WideMap(const RollingMap& map, const WideMapParams& params);

  static constexpr std::array<double, 3> kVoxel_m = {12.0, 6.0, 3.0};

  struct Gaussian {
    Vec3f mean;
    std::array<float, 6> information;  ///< xx xy xz yy yz zz [1/m^2]
  };
  /// The nearest mean in the voxel of `p` and the seven voxels closest to it; null: none.
  [[nodiscard]] const Gaussian* nearest(std::size_t level, const Vec3f& p) const;

 private:
  struct Level {
    Level(double voxel_m, std::size_t capacity);
    template <class Visit>
    void add(const Visit& visit_all);
    void fit(const WideMapParams& params);
    float voxel_m;
    float per_m;
    VoxelIndex index;              // of moments while it is filled, then of gaussians
    std::vector<VoxelKey> keys;    // of moments
    std::vector<Moments> moments;  // in the map's frame
    std::vector<Gaussian> gaussians;
  };
  std::vector<Level> levels_;
};

}  // namespace rcs::registration
