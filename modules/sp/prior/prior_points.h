#pragma once
// Residuals of a scan to the surface points of above-ground structure in the a priori map.

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
  int max_points = 150;      ///< of a scan that are matched; 0: surface points are not used
  double gate_m = 0.4;       ///< larger distance from a surface point: no match
  double min_sigma_m = 0.2;  ///< lower bound of the sigma of a surface point
  /// The scan's points in a cube of this edge share the map's error: they count as one
  double voxel_m = 2.0;
  double normal_sigma_rad = 0.15;  ///< of the map's normals
  int min_voxels = 3;              ///< fewer are rejected: a bush can pass for a trunk
};

struct PriorPointsWorkspace {
  struct Match {
    StandingHere here;
    bool found = false;
    std::uint32_t* points = nullptr;  ///< in its voxel; null: no match
  };
  std::optional<Pose> T_searched;  ///< pose of the search for `here`; none: no search yet
  registration::ScanTable<std::uint32_t> points;  ///< by voxel
  std::vector<Match> matches;
};

struct PointSums {
  registration::NormalEquations equations;  ///< with the errors of the normals
  double square_u = 0.0;                    ///< of residuals in sigmas, weighted
  double weight_u = 0.0;
  int voxels = 0;  ///< with matches; if too few, the sums are empty
};

/// Point-to-plane along the map's normals, if the surface is observed from the same side as in the
/// map. The closest points are searched again when the pose has moved by centimetres.
/// @param standing_vehicle  [m]
/// @param spread_m  inflation of the residuals beyond the map's sigma; the gate grows by twice this
/// @param robust_sigma, gate_sigma  as for the ground
[[nodiscard]] PointSums sum_points(const Points& standing_vehicle, const ElevationMap& map,
                                   const Pose& T_map_vehicle, const PriorPointParams& params,
                                   double robust_sigma, double gate_sigma, double spread_m,
                                   PriorPointsWorkspace* workspace);

}  // namespace rcs::sp
