#pragma once
// How well a stretch of ground lies on the a priori map, at one place and heading.

#include <vector>

#include "modules/registration/voxel_table.h"
#include "modules/sp/prior/ground_patch.h"
#include "rcs/base/work_units.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct GroundFitParams {
  double ground_sigma_m = 0.12;    ///< of a lowest point above the ground: grass, rocks
  double least_map_sigma_m = 0.1;  ///< the map is not believed beyond this
  double robust_sigma = 3.0;       ///< a residual costs this squared, halved, at most
  /// Cells of a block err together (grass, the survey, the drift of the way): they count as one
  /// observation.
  double block_m = 6.0;
  double tilt_sigma_rad = 0.006;  ///< of frame level's plumb line
  /// What the map must explain is what a plane over so much of the ground does not.
  double plane_m = 30.0;
};

/// A stretch of ground, ready to be held against the map. Its cells are relative to `centre_level`.
struct GroundSubmap {
  struct Sample {
    Vec3 p = Vec3::Zero();  ///< p_level - centre_level [m]
    double weight = 0.0;    ///< the samples of a block weigh 1 together
    double rough_m = 0.0;   ///< above the plane through its neighbourhood; NaN: too few for one
  };
  Vec3 centre_level = Vec3::Zero();
  std::vector<Sample> samples;  ///< in no order in space
  double blocks = 0.0;          ///< sum of the weights
  double radius_m = 0.0;        ///< root mean square of the distances from the centre
  double slope = 0.0;           ///< root mean square of the planes' slopes
};

struct GroundSubmapWorkspace {
  struct Plane {
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    Vec3 c = Vec3::Zero();  ///< z = c0 + c1 x + c2 y, about the middle of its square
    int samples = 0;
  };
  registration::ScanTable<std::uint32_t> table;
  std::vector<int> counts;
  std::vector<std::uint32_t> member;
  std::vector<Plane> planes;
};

/// @param cells  of which the first `most` are taken
void make_submap(const std::vector<GroundCell>& cells, std::size_t most,
                 const GroundFitParams& params, GroundSubmapWorkspace* workspace,
                 GroundSubmap* submap);

/// Where a submap lies: its centre, a turn about the vertical from frame level to the map's, and
/// how far frame level is not upright there.
struct GroundPlace {
  Vec3 centre_map = Vec3::Zero();
  double yaw_rad = 0.0;
  Vec2 tilt = Vec2::Zero();  ///< heights grow by tilt . (p - centre), map axes
};

[[nodiscard]] Pose T_map_level(const GroundSubmap& submap, const GroundPlace& place);
[[nodiscard]] GroundPlace place_of(const GroundSubmap& submap, const Pose& T_map_level);

/// Mean cost a sample of the first `most` samples, the height that fits best taken; infinite where
/// the map knows fewer than half of them.
/// @param spread_m  what residuals may have beyond the sigmas: the place is not exact
/// @param residuals  workspace
[[nodiscard]] double rough_cost(const GroundSubmap& submap, const ElevationMap& map,
                                const GroundFitParams& params, std::size_t most, double spread_m,
                                GroundPlace* place, std::vector<double>* residuals);

/// One robust Gauss-Newton step of place, height, heading and tilt.
/// @return how far the samples moved, root mean square [m]; negative: there is nothing to go by
[[nodiscard]] double refine(const GroundSubmap& submap, const ElevationMap& map,
                            const GroundFitParams& params, double spread_m, GroundPlace* place);

/// What is to be said for a place. Costs are negative log likelihoods, summed over blocks.
struct GroundVerdict {
  double cost = 0.0;        ///< of the ground, the map being right
  double plane_cost = 0.0;  ///< if it were planes instead, fitted to itself: the map must do better
  double blocks = 0.0;      ///< that were looked at
  double known = 0.0;       ///< share of the samples where the map knows the ground
  /// Of (x, y, z of the centre [m], yaw, tilt [rad]); what slopes that are only the map's noise
  /// seem to tell is not in it. Huge along what the ground does not tell.
  Mat6 covariance = Mat6::Zero();
};
[[nodiscard]] GroundVerdict judge(const GroundSubmap& submap, const ElevationMap& map,
                                  const GroundFitParams& params, const GroundPlace& place);

/// Looks at the map for a sample: one in rough_cost(), so many in refine() and judge().
constexpr WorkUnits kLooksForSlope = 5;

}  // namespace rcs::sp
