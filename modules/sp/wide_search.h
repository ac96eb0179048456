#pragma once
// Registration from afar: voxels of 12, 6 and 3 m stand for the map by their normal distributions
// (NDT: Magnusson 2009; point to distribution), the widest first.

#include <array>
#include <vector>

#include "modules/sp/registration.h"
#include "modules/sp/rolling_map.h"
#include "modules/sp/voxel_index.h"
#include "rcs/base/points.h"

namespace rcs::sp {

struct WideParams {
  int points = 800;             ///< of the scan that are looked at, about, [100, 100000]
  double range_sigma_m = 0.03;  ///< added to every distribution, [0.001, 1]
  double flatness = 0.2;    ///< least variance of a distribution over its largest: how far off its
                            ///< surface a point is still drawn to it, [0.001, 1]
  double robust = 27.0;     ///< squared distance, in sigmas, at which the weight is 1/4, [1, 1000]
  int max_iterations = 40;  ///< at each of the two widest sizes, [1, 1000]
};
// flatness and robust: chosen on the tuning pairs of tests/sp/real_cuts_test.cpp.

/// What the wide search sees of a map. Static once it is made.
class WideMap {
 public:
  WideMap(const RollingMap& map, const WideParams& params);

  static constexpr std::array<double, 3> kVoxel_m = {12.0, 6.0, 3.0};

  struct Gaussian {
    Vec3f mean;
    std::array<float, 6> information;  ///< xx xy xz yy yz zz [1/m^2]
  };
  /// The nearest mean among the voxel of `p` and the seven that it is closest to; null: none.
  [[nodiscard]] const Gaussian* nearest(std::size_t level, const Vec3f& p) const;

 private:
  struct Level {
    Level(double voxel_m, std::size_t capacity);
    template <class Visit>
    void add(const Visit& visit_all);
    void fit(const WideParams& params);
    float voxel_m;
    float per_m;
    VoxelIndex index;              // while it is filled of moments, then of gaussians
    std::vector<VoxelKey> keys;    // of moments
    std::vector<Moments> moments;  // in the map's frame
    std::vector<Gaussian> gaussians;
  };
  std::vector<Level> levels_;
};

struct WideAnswer {
  Pose T_target_vehicle;
  double score = 0.0;  ///< mean robust weight of the points at the finest of the sizes, [0, 1]
  int iterations = 0;
  WorkUnits used = 0;
};

/// Every n-th point, so that about `wanted` are left.
[[nodiscard]] Points thinned(const Points& points, int wanted);

/// Two descents from the same guess, one from the widest size and one from the finest (where little
/// overlaps, the widest one is misled by what only one of the two has seen); the one that explains
/// more of the scan is the answer.
/// @param source_vehicle  as dense as the sensor saw it: the near ground, which has most of the
///                        points, holds height, roll and pitch while the rest is found
[[nodiscard]] WideAnswer search_wide(const Points& source_vehicle, const WideMap& map,
                                     const Pose& guess, const WideParams& params);

}  // namespace rcs::sp
