#pragma once
// Production registration: point-to-plane least squares of a scan against the rolling map.

#include <array>
#include <cstdint>
#include <vector>

#include "modules/registration/registration.h"
#include "modules/registration/rolling_map.h"
#include "rcs/base/points.h"

namespace rcs::registration {

struct IcpParams {
  int max_iterations = 20;
  int min_pairs = 50;             ///< fewer: kTooFew
  double gate_m = 1.0;            ///< largest distance along the normal at the start
  double gate_sigma = 4.0;        ///< and at the end, in sigmas of the residual
  double range_sigma_m = 0.03;    ///< LADAR range noise
  double beam_sigma_rad = 0.001;  ///< pointing noise across the beam
  double map_sigma_m = 0.02;      ///< error of a surface in the outlier test
  double min_map_sigma_m = 0.02;  ///< lower bound of the error that its points share
  /// Weights each residual by its own variance, from the range, the angle of incidence and the
  /// surface. If false, all weights are equal: to measure the effect of the LADAR's noise model.
  bool weighted = true;
  double min_alignment = 1e-4;      ///< observability below which a direction is unobserved
  double max_sigma_m = 0.5;         ///< a direction with a larger sigma is unobserved
  double max_correction_m = 2.0;    ///< larger distance from the prediction: kDiverged
  double max_correction_rad = 0.2;  ///< likewise
  double step_sigma = 0.03;         ///< converged when a step is smaller, in sigmas
};

/// Buffers of register_points, kept between scans.
class IcpWorkspace {
 public:
  struct Match {
    Vec3f asked = Vec3f::Constant(1e9F);  // position of the search, rolling frame
    Surface surface{};
    bool found = false;
  };
  std::vector<Match> matches;
  std::array<std::vector<std::uint32_t>, 2> found;  // points with a match, of both directions
  std::vector<std::uint32_t> pairs_of_voxel;
};

/// Aligns `source_vehicle` to the map (point-to-plane, Chen & Medioni 1992, with Geman-McClure
/// weights and a gate that shrinks to the noise).
/// @param source_vehicle  deskewed, downsampled points [m]
/// @param prediction  with an error of at most about one or two voxels, or it may stop in a local
///   minimum. It regularizes the iterations and the unobserved directions, and adds nothing else to
///   the result: the last step is without it.
/// @param map  non-const because surfaces are fitted at their first use
/// @param granted  work units; when they are used up, the best result so far is returned
/// Deterministic. No allocation once `workspace` has held a scan as large.
[[nodiscard]] Registration register_points(const Points& source_vehicle, RollingMap* map,
                                           const Prediction& prediction, const IcpParams& params,
                                           WorkUnits granted, IcpWorkspace* workspace);

/// The other direction of a registration of two scans.
struct Counterpart {
  const Points* target_points;  ///< frame of the target [m], thinned
  RollingMap* source_map;       ///< surfaces of the source, in its frame
};

/// register_points() with pairs in both directions: points of the source on surfaces of the target,
/// and the reverse. The errors of sparse surfaces of single scans average out.
[[nodiscard]] Registration register_both_ways(const Points& source_vehicle, RollingMap* map,
                                              const Counterpart& counterpart,
                                              const Prediction& prediction, const IcpParams& params,
                                              WorkUnits granted, IcpWorkspace* workspace);

}  // namespace rcs::registration
