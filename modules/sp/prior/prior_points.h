#pragma once
// Residuals of a scan to the a priori map's surface points: what stands on its ground.

#include <cstdint>
#include <optional>
#include <vector>

#include "modules/registration/normal_equations.h"
#include "modules/registration/voxel_table.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct PriorPointParams {
  int most = 150;            ///< of a scan that are matched; 0: the map's points are not used
  double gate_m = 0.4;       ///< farther from a point of the map: no match
  double min_sigma_m = 0.2;  ///< the map's points are not believed beyond this
  /// The scan's points in a cube of this edge share the map's error: they count as one
  double voxel_m = 2.0;
  double normal_sigma_rad = 0.15;  ///< of the map's normals
  int min_voxels = 3;              ///< fewer are no evidence: a bush for a trunk
};

struct PriorPointsWorkspace {
  struct Match {
    StandingHere here;
    bool found = false;
    std::uint32_t* points = nullptr;  ///< in its voxel; null: no match
  };
  std::optional<Pose> T_searched;                 ///< where `here` is from; none: not searched yet
  registration::ScanTable<std::uint32_t> points;  ///< by voxel
  std::vector<Match> matches;
};

struct PointSums {
  registration::NormalEquations equations;  ///< with the normals' own errors
  double square_u = 0.0;                    ///< of residuals in sigmas, weighed
  double weight_u = 0.0;
  int voxels = 0;  ///< with matches; if too few, the sums are empty
};

/// Point-to-plane along the map's normals, where the surface is seen from the side that the map
/// knows. The closest points are searched anew when the pose has moved by centimetres.
/// @param standing_vehicle  [m]
/// @param spread_m  what residuals may have beyond the map's sigma; the gate grows by twice this
/// @param robust_sigma, gate_sigma  as of the ground
[[nodiscard]] PointSums sum_points(const Points& standing_vehicle, const ElevationMap& map,
                                   const Pose& T_map_vehicle, const PriorPointParams& params,
                                   double robust_sigma, double gate_sigma, double spread_m,
                                   PriorPointsWorkspace* workspace);

}  // namespace rcs::sp
