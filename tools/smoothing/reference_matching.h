#pragma once
// Registrations between scans: the points at a node registered to maps around other nodes, of the
// same pass and of other passes. Pure, except for worker threads.

#include <cstddef>
#include <functional>
#include <vector>

#include "modules/sp/sp_config.h"
#include "tools/smoothing/reference_nodes.h"

namespace rcs::smoothing {

struct MatchingParams {
  double map_reach_m = 10.0;    ///< distance before and after a node that its map covers
  double map_spacing_m = 8.0;   ///< distance between nodes with maps
  double before_m = 12.0;       ///< min distance from a map to a scan of the same pass
  double before_span_m = 20.0;  ///< max distance: before_m plus this
  double other_pass_m = 60.0;   ///< distance above which scans are of different passes
  double view_m = 15.0;         ///< max distance of the centres of two overlapping views
  double turn_m_per_rad = 5.0;  ///< distance equivalent to a rotation between views
  double source_voxel_m = 0.4;
  double sigma_floor_m = 0.01;  ///< lower bound of the sigma of a match, per axis
  double sigma_floor_rad = 3e-4;
  std::size_t jobs = 1;
};

/// The points around a node, relative to its seen_pose().
struct NodeCloud {
  Points dense;   ///< for maps
  Points source;  ///< to be registered
  Vec3 middle = Vec3::Zero();
};

[[nodiscard]] std::vector<NodeCloud> node_clouds(const ReferenceRecording& recording,
                                                 const ReferenceGraph& graph,
                                                 const SharedErrors& shared, const sp::SpConfig& sp,
                                                 const MatchingParams& params);

struct PlannedMatch {
  std::size_t map = 0, scan = 0;
  bool revisit = false;
};

/// Selects the scans to be registered to each map.
/// @param seen  seen_pose() of each node
[[nodiscard]] std::vector<PlannedMatch> plan_matches(const std::vector<NodeCloud>& clouds,
                                                     const std::vector<double>& travelled_m,
                                                     const std::vector<Pose>& seen,
                                                     const MatchingParams& params);

struct MatchCount {
  std::size_t tried = 0;
  std::size_t made = 0;
};

struct Matches {
  std::vector<MatchEdge> edges;
  MatchCount consecutive, revisit;
};

/// @param prior_sigma_m  of the start positions of the search; of angles a thirtieth [rad]
/// @param progress  (done, in all), from one thread
/// @param stop  polled; true ends the work
[[nodiscard]] Matches match_nodes(const std::vector<NodeCloud>& clouds,
                                  const std::vector<double>& travelled_m,
                                  const std::vector<Pose>& seen, const sp::SpConfig& sp,
                                  const MatchingParams& params, double prior_sigma_m,
                                  const std::function<void(std::size_t, std::size_t)>& progress,
                                  const std::function<bool()>& stop);

/// Residuals of the scans against the surfaces of their common map.
struct MapResidual {
  double rms_m = 0.0;     ///< along the normals
  double median_m = 0.0;  ///< of the magnitudes
  double share = 0.0;     ///< share of the points with a surface within the gate
  std::size_t points = 0;
};
[[nodiscard]] MapResidual map_residual(const std::vector<NodeCloud>& clouds,
                                       const std::vector<double>& travelled_m,
                                       const std::vector<Pose>& seen, const sp::SpConfig& sp,
                                       const MatchingParams& params, double gate_m);

}  // namespace rcs::smoothing
