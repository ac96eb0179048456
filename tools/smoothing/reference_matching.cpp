#include "tools/smoothing/reference_matching.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "modules/registration/point_to_plane_icp.h"
#include "modules/registration/voxel_sampler.h"
#include "tools/base/threads.h"

namespace rcs::smoothing {
namespace {

constexpr int kMapCapacity = 60'000;

registration::RollingMapParams map_params(const sp::SpConfig& config) {
  registration::RollingMapParams p = config.map;
  p.capacity = kMapCapacity;
  p.max_points = 10'000;  // use all points of a voxel
  p.radius_m = 500.0;
  p.archive = 0;
  return p;
}

void append(const Points& in, const Pose& T, Points* out) {
  const Mat3f R = T.rotation().cast<float>();
  const Vec3f t = T.p.cast<float>();
  for (std::size_t i = 0; i < in.size(); ++i) out->push_back(R * in[i] + t);
}

/// Nodes with clouds at a spacing of `map_spacing_m`.
std::vector<std::size_t> map_nodes(const std::vector<NodeCloud>& clouds,
                                   const std::vector<double>& travelled_m, double spacing_m) {
  std::vector<std::size_t> nodes;
  for (std::size_t n = 0; n < clouds.size(); ++n) {
    if (clouds[n].dense.empty()) continue;
    if (nodes.empty() || travelled_m[n] - travelled_m[nodes.back()] >= spacing_m)
      nodes.push_back(n);
  }
  return nodes;
}

/// At rest the same scene is observed repeatedly: a subset suffices.
std::vector<std::size_t> scan_nodes(const std::vector<NodeCloud>& clouds,
                                    const std::vector<double>& travelled_m) {
  return map_nodes(clouds, travelled_m, 1.0);
}

void build_map(const std::vector<NodeCloud>& clouds, const std::vector<double>& travelled_m,
               const std::vector<Pose>& seen, std::size_t at, const MatchingParams& p,
               registration::RollingMap* map) {
  map->clear();
  const Pose back = seen[at].inverse();
  double last_m = -1e9;
  for (std::size_t n = 0; n < clouds.size(); ++n) {
    if (std::abs(travelled_m[n] - travelled_m[at]) > p.map_reach_m) continue;
    if (travelled_m[n] - last_m < 0.5) continue;
    last_m = travelled_m[n];
    map->insert(clouds[n].dense, back * seen[n]);
  }
}

/// The information by the residuals, limited by the floor: (I^-1 + F)^-1, also for singular I.
Mat6 floored(const Mat6& information, const MatchingParams& p) {
  Vec6 floor;
  floor << Vec3::Constant(p.sigma_floor_m), Vec3::Constant(p.sigma_floor_rad);
  const Mat6 F = floor.cwiseAbs2().asDiagonal();
  const Mat6 left = Mat6::Identity() + information * F;
  const Mat6 out = left.partialPivLu().solve(information);
  return 0.5 * (out + out.transpose());
}

std::optional<MatchEdge> match(const PlannedMatch& plan, const std::vector<NodeCloud>& clouds,
                               const std::vector<Pose>& seen, const sp::SpConfig& config,
                               const MatchingParams& p, double prior_sigma_m,
                               registration::RollingMap* map,
                               registration::IcpWorkspace* workspace) {
  constexpr WorkUnits kPlenty = 1'000'000'000;
  registration::Prediction prediction;
  prediction.T_target_vehicle = seen[plan.map].inverse() * seen[plan.scan];
  const double s2 = prior_sigma_m * prior_sigma_m;
  prediction.covariance.setZero();
  prediction.covariance.diagonal() << Vec3::Constant(s2), Vec3::Constant(s2 / 900.0);
  registration::IcpParams icp = config.icp;
  icp.max_iterations = 30;
  const registration::Registration found = registration::register_points(
      clouds[plan.scan].source, map, prediction, icp, kPlenty, workspace);
  if (!registration::usable(found.stop)) return std::nullopt;
  MatchEdge e;
  e.map = plan.map;
  e.scan = plan.scan;
  e.revisit = plan.revisit;
  e.T_map_scan = found.T_target_vehicle;
  e.information = floored(found.information, p);
  e.rms_m = found.rms_m;
  e.overlap = found.overlap;
  return e;
}

}  // namespace

std::vector<NodeCloud> node_clouds(const ReferenceRecording& r, const ReferenceGraph& g,
                                   const SharedErrors& shared, const sp::SpConfig& config,
                                   const MatchingParams& params) {
  std::vector<NodeCloud> clouds(g.nodes.size());
  registration::VoxelSampler sampler;
  for (std::size_t n = 0; n < g.nodes.size(); ++n) {
    const ReferenceNode& node = g.nodes[n];
    const Duration delay = from_seconds(shared.ladar_delay_s);
    const Pose T_node_local = local_pose(r, node.stamp + delay).inverse();
    Points all;
    for (std::size_t k = node.first_scan; k < node.end_scan; ++k) {
      const Pose moved = T_node_local * local_pose(r, r.scans[k].reference + delay);
      append(r.scans[k].points_vehicle, shared.mount.inverse() * moved * shared.mount, &all);
    }
    NodeCloud& cloud = clouds[n];
    sampler.sample(all, config.map_voxel_m, &cloud.dense);
    sampler.sample(all, std::max(params.source_voxel_m, config.source_voxel_m), &cloud.source);
    for (std::size_t i = 0; i < cloud.source.size(); ++i) {
      cloud.middle += cloud.source[i].cast<double>() / static_cast<double>(cloud.source.size());
    }
  }
  return clouds;
}

std::vector<PlannedMatch> plan_matches(const std::vector<NodeCloud>& clouds,
                                       const std::vector<double>& travelled_m,
                                       const std::vector<Pose>& seen, const MatchingParams& p) {
  std::vector<PlannedMatch> plan;
  const std::vector<std::size_t> maps = map_nodes(clouds, travelled_m, p.map_spacing_m);
  const std::vector<std::size_t> scans = scan_nodes(clouds, travelled_m);
  const auto middle = [&](std::size_t n) { return seen[n] * clouds[n].middle; };
  for (const std::size_t scan : scans) {
    // Each connected section of near maps is one pass: use its nearest map.
    std::optional<std::size_t> best;
    double best_m = 0.0;
    double last_near_m = -1e9;
    const auto close_pass = [&] {
      if (best) plan.push_back({*best, scan, true});
      best.reset();
    };
    for (const std::size_t map : maps) {
      const double ahead_m = travelled_m[scan] - travelled_m[map];
      if (ahead_m >= p.before_m && ahead_m <= p.before_m + p.before_span_m) {
        plan.push_back({map, scan, false});
      }
      if (std::abs(ahead_m) < p.other_pass_m) continue;
      const double turn = 2.0 * std::acos(std::min(1.0, std::abs(seen[map].q.dot(seen[scan].q))));
      const double d_m = (middle(map) - middle(scan)).norm();
      if (d_m > p.view_m) continue;
      const double counts_m = d_m + p.turn_m_per_rad * turn;
      if (travelled_m[map] - last_near_m > 2.0 * p.map_spacing_m + 1.0) close_pass();
      last_near_m = travelled_m[map];
      if (!best || counts_m < best_m) {
        best = map;
        best_m = counts_m;
      }
    }
    close_pass();
  }
  std::stable_sort(plan.begin(), plan.end(),
                   [](const PlannedMatch& a, const PlannedMatch& b) { return a.map < b.map; });
  return plan;
}

Matches match_nodes(const std::vector<NodeCloud>& clouds, const std::vector<double>& travelled_m,
                    const std::vector<Pose>& seen, const sp::SpConfig& config,
                    const MatchingParams& params, double prior_sigma_m,
                    const std::function<void(std::size_t, std::size_t)>& progress,
                    const std::function<bool()>& stop) {
  const std::vector<PlannedMatch> plan = plan_matches(clouds, travelled_m, seen, params);
  std::vector<std::optional<MatchEdge>> found(plan.size());
  const std::size_t jobs = std::max<std::size_t>(params.jobs, 1);
  tools::in_threads(jobs, [&](std::size_t job) {
    registration::RollingMap map(map_params(config));
    registration::IcpWorkspace workspace;
    std::optional<std::size_t> built;
    const std::size_t begin = plan.size() * job / jobs;
    const std::size_t end = plan.size() * (job + 1) / jobs;
    for (std::size_t k = begin; k < end && !stop(); ++k) {
      if (built != plan[k].map) build_map(clouds, travelled_m, seen, plan[k].map, params, &map);
      built = plan[k].map;
      found[k] = match(plan[k], clouds, seen, config, params, prior_sigma_m, &map, &workspace);
      if (job == 0) progress(k, end);
    }
  });
  Matches out;
  for (std::size_t k = 0; k < plan.size(); ++k) {
    MatchCount& count = plan[k].revisit ? out.revisit : out.consecutive;
    ++count.tried;
    if (!found[k]) continue;
    ++count.made;
    out.edges.push_back(*found[k]);
  }
  return out;
}

MapResidual map_residual(const std::vector<NodeCloud>& clouds,
                         const std::vector<double>& travelled_m, const std::vector<Pose>& seen,
                         const sp::SpConfig& config, const MatchingParams& params, double gate_m) {
  constexpr double kStride_m = 150.0;
  constexpr double kNear_m = 25.0;
  std::vector<double> residuals;
  std::size_t tried = 0;
  registration::RollingMap map(map_params(config));
  for (const std::size_t at : map_nodes(clouds, travelled_m, kStride_m)) {
    map.clear();
    const Pose back = seen[at].inverse();
    const Vec3 centre = seen[at] * clouds[at].middle;
    std::vector<std::size_t> members;
    for (const std::size_t n : map_nodes(clouds, travelled_m, params.map_spacing_m / 2.0)) {
      if ((seen[n] * clouds[n].middle - centre).norm() < kNear_m) members.push_back(n);
    }
    for (const std::size_t n : members) map.insert(clouds[n].dense, back * seen[n]);
    for (const std::size_t n : members) {
      const Mat3f R = (back * seen[n]).rotation().cast<float>();
      const Vec3f t = (back * seen[n]).p.cast<float>();
      for (std::size_t i = 0; i < clouds[n].source.size(); ++i) {
        const Vec3f p = R * clouds[n].source[i] + t;
        registration::Surface surface;
        ++tried;
        if (!map.nearest_surface(p, &surface)) continue;
        const auto d_m = static_cast<double>(std::abs(surface.normal.dot(p - surface.mean)));
        if (d_m <= gate_m) residuals.push_back(d_m);
      }
    }
  }
  MapResidual out;
  out.points = residuals.size();
  if (residuals.empty()) return out;
  double sum = 0.0;
  for (const double d : residuals) sum += d * d;
  out.rms_m = std::sqrt(sum / static_cast<double>(residuals.size()));
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  out.median_m = *middle;
  out.share = static_cast<double>(residuals.size()) / static_cast<double>(tried);
  return out;
}

}  // namespace rcs::smoothing
