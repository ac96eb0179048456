#pragma once
// Fit of a stretch of ground to the a priori map, at one position and heading.

#include <vector>

#include "modules/registration/voxel_table.h"
#include "modules/sp/prior/ground_patch.h"
#include "rcs/base/work_units.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct GroundFitParams {
  double ground_sigma_m = 0.12;  ///< of a lowest point above the ground: grass, rocks
  double min_map_sigma_m = 0.1;  ///< lower bound of the map's sigma
  double robust_sigma = 3.0;     ///< a residual costs half the square of this at most
  /// The errors of cells of a block are correlated (grass, survey, drift): they count as one
  /// observation.
  double block_m = 6.0;
  double tilt_sigma_rad = 0.006;  ///< of frame level against the vertical
  /// Edge of the squares with a fitted plane; the map must explain the residuals of these planes.
  double plane_m = 30.0;
};

/// A stretch of ground, prepared for the comparison with the map. Its cells are relative to
/// `centre_level`.
struct GroundSubmap {
  struct Sample {
    Vec3 p = Vec3::Zero();  ///< p_level - centre_level [m]
    double weight = 0.0;    ///< the samples of a block weigh 1 together
    double rough_m = 0.0;   ///< above the plane of its square; NaN: too few samples for one
  };
  Vec3 centre_level = Vec3::Zero();
  std::vector<Sample> samples;  ///< in no spatial order
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

/// @param cells  the first `most` of these are used
void make_submap(const std::vector<GroundCell>& cells, std::size_t most,
                 const GroundFitParams& params, GroundSubmapWorkspace* workspace,
                 GroundSubmap* submap);

/// Candidate pose of a submap: its centre, the rotation about the vertical from frame level to the
/// map's, and the tilt of frame level there.
struct GroundPlace {
  Vec3 centre_map = Vec3::Zero();
  double yaw_rad = 0.0;
  Vec2 tilt = Vec2::Zero();  ///< heights grow by tilt . (p - centre), map axes
};

[[nodiscard]] Pose T_map_level(const GroundSubmap& submap, const GroundPlace& place);
[[nodiscard]] GroundPlace place_of(const GroundSubmap& submap, const Pose& T_map_level);

/// Mean cost of the first `most` samples, with the best-fitting height; infinite if the map has
/// data for fewer than half of them.
/// @param spread_m  inflation of the residuals beyond the sigmas, for an inexact candidate
/// @param residuals  workspace
[[nodiscard]] double rough_cost(const GroundSubmap& submap, const ElevationMap& map,
                                const GroundFitParams& params, std::size_t most, double spread_m,
                                GroundPlace* place, std::vector<double>* residuals);

/// One robust Gauss-Newton step of position, height, heading and tilt.
/// @return root mean square displacement of the samples [m]; negative: no usable sample
[[nodiscard]] double refine(const GroundSubmap& submap, const ElevationMap& map,
                            const GroundFitParams& params, double spread_m, GroundPlace* place);

/// Evaluation of a candidate pose. Costs are negative log-likelihoods, summed over blocks.
struct GroundVerdict {
  double cost = 0.0;        ///< of the ground, given the map
  double plane_cost = 0.0;  ///< given planes fitted to the ground instead; the map must be better
  double blocks = 0.0;      ///< number of evaluated blocks
  double known = 0.0;       ///< share of the samples with map data
  /// Of (x, y, z of the centre [m], yaw, tilt [rad]), without the apparent information of slopes
  /// that are only noise of the map. Very large along directions without information.
  Mat6 covariance = Mat6::Zero();
};
[[nodiscard]] GroundVerdict judge(const GroundSubmap& submap, const ElevationMap& map,
                                  const GroundFitParams& params, const GroundPlace& place);

/// Map lookups for each sample: one in rough_cost(), this many in refine() and judge().
constexpr WorkUnits kLooksForSlope = 5;

}  // namespace rcs::sp
