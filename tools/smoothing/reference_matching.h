#pragma once
// Scans among themselves: what is seen at a node registered to the map around other nodes, just
// before and on other passes. Pure but for the threads that share the work.

#include <cstddef>
#include <functional>
#include <vector>

#include "modules/sp/sp_config.h"
#include "tools/smoothing/reference_nodes.h"

namespace rcs::smoothing {

struct MatchingParams {
  double map_reach_m = 10.0;    ///< of way before and after a node that make its map
  double map_spacing_m = 8.0;   ///< of way between nodes that have maps
  double before_m = 12.0;       ///< of way from a map to a scan of the same pass, at least
  double before_span_m = 20.0;  ///< and at most so much more
  double other_pass_m = 60.0;   ///< of way: farther apart is another pass
  double view_m = 15.0;         ///< between the middles of two views that are of one place
  double turn_m_per_rad = 5.0;  ///< by what views count as farther that look elsewhere
  double source_voxel_m = 0.4;
  double sigma_floor_m = 0.01;  ///< no match is better, each axis
  double sigma_floor_rad = 3e-4;
  std::size_t jobs = 1;
};

/// What the LADAR saw around a node, by how it sees the vehicle there.
struct NodeCloud {
  Points dense;   ///< for maps
  Points source;  ///< to be registered
  Vec3 middle = Vec3::Zero();
};

[[nodiscard]] std::vector<NodeCloud> node_clouds(const TruthRecording& recording,
                                                 const TruthGraph& graph,
                                                 const SharedErrors& shared, const sp::SpConfig& sp,
                                                 const MatchingParams& params);

struct PlannedMatch {
  std::size_t map = 0, scan = 0;
  bool revisit = false;
};

/// Which scans are worth registering to which maps, by map.
/// @param seen  seen_pose() of each node
[[nodiscard]] std::vector<PlannedMatch> plan_matches(const std::vector<NodeCloud>& clouds,
                                                     const std::vector<double>& way_m,
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

/// @param prior_sigma_m  of the places that the search starts from; of angles a thirtieth
/// @param progress  (done, in all), from one thread
/// @param stop  asked now and then
[[nodiscard]] Matches match_nodes(const std::vector<NodeCloud>& clouds,
                                  const std::vector<double>& way_m, const std::vector<Pose>& seen,
                                  const sp::SpConfig& sp, const MatchingParams& params,
                                  double prior_sigma_m,
                                  const std::function<void(std::size_t, std::size_t)>& progress,
                                  const std::function<bool()>& stop);

/// How well the scans lie on the surfaces of the map that all of them make.
struct MapResidual {
  double rms_m = 0.0;     ///< along the normals
  double median_m = 0.0;  ///< of the magnitudes
  double share = 0.0;     ///< of the points that have a surface within the gate
  std::size_t points = 0;
};
[[nodiscard]] MapResidual map_residual(const std::vector<NodeCloud>& clouds,
                                       const std::vector<double>& way_m,
                                       const std::vector<Pose>& seen, const sp::SpConfig& sp,
                                       const MatchingParams& params, double gate_m);

}  // namespace rcs::smoothing
