#include "tools/smoothing/reference_nodes.h"

#include <algorithm>
#include <cmath>

namespace rcs::smoothing {
namespace {

constexpr double kMaxWheelSpan_s = 0.3;  // max time of wheel samples from their node
constexpr double kAccelGainShare = 2.0;  // cross-axis gain and scale, for gyros and accelerometers

/// The belief at or before `stamp`, or the first; the last only if it is the only one.
std::size_t belief_before(const std::vector<RecordedBelief>& beliefs, Stamp stamp) {
  const auto after = std::upper_bound(beliefs.begin(), beliefs.end(), stamp,
                                      [](Stamp t, const RecordedBelief& b) { return t < b.stamp; });
  const auto k = static_cast<std::size_t>(after - beliefs.begin());
  const std::size_t last_begin = beliefs.size() < 2 ? 0 : beliefs.size() - 2;
  return std::min(k == 0 ? 0 : k - 1, last_begin);
}

double share_at(const RecordedBelief& a, const RecordedBelief& b, Stamp stamp) {
  return seconds(stamp - a.stamp) / seconds(b.stamp - a.stamp);
}

/// Velocity in vehicle axes.
Vec3 velocity_at(const ReferenceRecording& r, Stamp stamp) {
  const std::size_t k = belief_before(r.beliefs, stamp);
  if (k + 1 >= r.beliefs.size()) return r.beliefs[k].v_vehicle;
  const double s = std::clamp(share_at(r.beliefs[k], r.beliefs[k + 1], stamp), 0.0, 1.0);
  return (1.0 - s) * r.beliefs[k].v_vehicle + s * r.beliefs[k + 1].v_vehicle;
}

Vec3 rate_at(const ReferenceRecording& r, Stamp stamp) {
  const std::size_t k = belief_before(r.beliefs, stamp);
  if (k + 1 >= r.beliefs.size()) return r.beliefs[k].rate_vehicle;
  const double s = std::clamp(share_at(r.beliefs[k], r.beliefs[k + 1], stamp), 0.0, 1.0);
  return (1.0 - s) * r.beliefs[k].rate_vehicle + s * r.beliefs[k + 1].rate_vehicle;
}

std::vector<ReferenceNode> place_nodes(const ReferenceRecording& r, const NodeParams& params) {
  std::vector<ReferenceNode> nodes;
  const Duration spacing = from_seconds(params.spacing_s);
  const Stamp begin = r.beliefs.front().stamp;
  const auto fill_until = [&](Stamp stamp) {
    while (!nodes.empty() && stamp - nodes.back().stamp > 2 * spacing) {
      nodes.push_back({nodes.back().stamp + spacing, 0, 0});
    }
  };
  for (std::size_t k = 0; k < r.scans.size(); ++k) {
    const Stamp stamp = r.scans[k].reference;
    if (stamp < begin || stamp > r.beliefs.back().stamp) continue;
    // Accept a scan slightly before the spacing is reached.
    const Duration early = spacing / 10;
    if (!nodes.empty() && stamp - nodes.back().stamp < spacing - early) continue;
    fill_until(stamp);
    nodes.push_back({stamp, k, k});
  }
  fill_until(r.beliefs.back().stamp);
  // Each scan belongs to the nearest node.
  std::size_t scan = 0;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Duration reach = spacing;
    while (scan < r.scans.size() && r.scans[scan].reference < nodes[n].stamp - reach / 2) ++scan;
    nodes[n].first_scan = scan;
    const Stamp end = n + 1 < nodes.size()
                          ? nodes[n].stamp + (nodes[n + 1].stamp - nodes[n].stamp) / 2
                          : Stamp::max();
    while (scan < r.scans.size() && r.scans[scan].reference <= end &&
           r.scans[scan].reference <= nodes[n].stamp + reach) {
      ++scan;
    }
    nodes[n].end_scan = scan;
  }
  return nodes;
}

std::size_t node_before(const std::vector<ReferenceNode>& nodes, Stamp stamp) {
  const auto after = std::upper_bound(nodes.begin(), nodes.end(), stamp,
                                      [](Stamp t, const ReferenceNode& n) { return t < n.stamp; });
  return after == nodes.begin() ? 0 : static_cast<std::size_t>(after - nodes.begin()) - 1;
}

void add_fixes(const ReferenceRecording& r, const wm::GpsParams& gps, ReferenceGraph* g) {
  const double white = std::sqrt(1.0 - gps.correlated * gps.correlated);
  for (const RecordedFix& f : r.fixes) {
    if (f.stamp < g->nodes.front().stamp || f.stamp > g->nodes.back().stamp) continue;
    GpsEdge e;
    e.node = node_before(g->nodes, f.stamp);
    e.stretch = g->gps_stretch[e.node];
    const Stamp at = g->nodes[e.node].stamp;
    e.T_node_vehicle = local_pose(r, at).inverse() * local_pose(r, f.stamp);
    e.dv_node = e.T_node_vehicle.q * velocity_at(r, f.stamp) - velocity_at(r, at);
    e.p_world_antenna = f.p_world;
    e.sigma_m = (white * f.sigma_m).cwiseMax(gps.sigma_floor_m);
    e.has_velocity = f.has_velocity;
    e.v_world = f.v_world;
    e.sigma_mps = f.sigma_mps;
    e.rate_radps = rate_at(r, f.stamp);
    g->graph.gps.push_back(e);
  }
}

void add_wheels(const ReferenceRecording& r, const wm::OdometryParams& odometry,
                ReferenceGraph* g) {
  std::size_t at = 0;
  for (std::size_t n = 0; n < g->nodes.size(); ++n) {
    const Stamp node = g->nodes[n].stamp;
    WheelEdge e;
    e.node = n;
    e.ahead.setZero();
    int count = 0;
    double variance = 0.0;
    const Pose T_node_local = local_pose(r, node).inverse();
    const Vec3 v_node = velocity_at(r, node);
    for (; at < r.wheels.size(); ++at) {
      const RecordedWheels& w = r.wheels[at];
      const Stamp middle = w.end - from_seconds(0.5 * w.interval_s);
      if (seconds(node - middle) > kMaxWheelSpan_s) continue;
      if (seconds(middle - node) > kMaxWheelSpan_s) break;
      if (n + 1 < g->nodes.size() && g->nodes[n + 1].stamp - middle < middle - node) break;
      const Vec3 ahead = (T_node_local * local_pose(r, middle)).q * Vec3::UnitX();
      e.ahead += ahead;
      // speed = ahead . (v_node + dv), in the axes of the node.
      const Vec3 v = (T_node_local * local_pose(r, middle)).q * velocity_at(r, middle);
      e.ahead_dv_mps += ahead.dot(v - v_node);
      e.speed_mps += w.speed_mps;
      variance += w.sigma_mps * w.sigma_mps;
      ++count;
    }
    if (count == 0) continue;
    e.ahead /= count;
    e.ahead_dv_mps /= count;
    e.speed_mps /= count;
    const double slip = odometry.slip * std::abs(e.speed_mps);
    e.sigma_mps = std::sqrt(variance / count / count + slip * slip);
    g->graph.wheels.push_back(e);
  }
}

void set_priors(const ReferenceRecording& r, const wm::WmParams& wm, const NodeParams& params,
                ReferenceGraph* g) {
  GraphPriors& p = g->graph.priors;
  const double wander = std::sqrt(2.0 * params.bias_stretch_s / wm.ins.bias_time_s);
  p.gyro_bias_radps = wm.ins.gyro_turn_on;
  p.accel_bias_mps2 = wm.ins.accel_turn_on + wm.ins.mount_sigma_rad * 9.8;
  p.gyro_wander_radps = wander * wm.ins.gyro_instability;
  p.accel_wander_mps2 = wander * wm.ins.accel_instability;
  p.gyro_scale = wm.ins.scale_and_misalignment;
  p.accel_gain = kAccelGainShare * wm.ins.scale_and_misalignment;
  p.wheel_scale = wm.odometry.scale_sigma;
  p.climb_slip = wm.odometry.climb_slip;
  p.mount_rad = 2.0 * wm.mount.sigma_rad;
  p.gps_tau_s = wm.drive.gps_tau_s;
  if (!r.fixes.empty()) {
    Vec3 mean = Vec3::Zero();
    for (const RecordedFix& f : r.fixes) mean += f.sigma_m;
    p.gps_sigma_m = wm.gps.correlated * mean / static_cast<double>(r.fixes.size());
    p.gps_sigma_m = p.gps_sigma_m.cwiseMax(1e-3);
  }
}

}  // namespace

Pose local_pose(const ReferenceRecording& r, Stamp stamp) {
  const std::size_t k = belief_before(r.beliefs, stamp);
  if (k + 1 >= r.beliefs.size()) return r.beliefs[k].T_local_vehicle;
  const double s = share_at(r.beliefs[k], r.beliefs[k + 1], stamp);
  return interpolate(r.beliefs[k].T_local_vehicle, r.beliefs[k + 1].T_local_vehicle, s);
}

ReferenceGraph make_reference_graph(const ReferenceRecording& r, const wm::WmParams& wm,
                                    const NodeParams& params) {
  ReferenceGraph g;
  g.nodes = place_nodes(r, params);
  if (g.nodes.empty()) return g;
  // Before the first world pose of WM, or without any, use its local motion.
  Pose T_world_local;
  for (const RecordedBelief& b : r.beliefs) {
    if (!b.world_valid) continue;
    T_world_local = b.T_world_vehicle * b.T_local_vehicle.inverse();
    g.has_world = !r.fixes.empty();
    break;
  }
  PoseGraph& graph = g.graph;
  graph.p_vehicle_antenna = wm.gps.lever_m;
  graph.gps_stretch_s = params.gps_stretch_s;
  if (r.datum) {
    graph.gravity_world = Vec3(0.0, 0.0, -normal_gravity(r.datum->lat_rad, r.datum->height));
    graph.earth_rate_world = earth_rate_world(r.datum->lat_rad);
  }
  const double period_s = params.spacing_s;
  for (std::size_t n = 0; n < g.nodes.size(); ++n) {
    const Stamp t = g.nodes[n].stamp;
    const RecordedBelief& b = r.beliefs[belief_before(r.beliefs, t)];
    if (g.has_world && b.world_valid) {
      T_world_local = b.T_world_vehicle * b.T_local_vehicle.inverse();
    }
    const Pose T = T_world_local * local_pose(r, t);
    const Vec3 v = velocity_at(r, t);
    g.travelled_m.push_back(
        n == 0 ? 0.0
               : g.travelled_m.back() +
                     (local_pose(r, t).p - local_pose(r, g.nodes[n - 1].stamp).p).norm());
    g.start.T_world_vehicle.push_back(T);
    g.start.v_world.push_back(T.q * v);
    Vec6 twist;
    twist << v, rate_at(r, t);
    graph.twist.push_back(twist);
    const double at_s = static_cast<double>(n) * period_s;
    g.bias_stretch.push_back(static_cast<std::size_t>(at_s / params.bias_stretch_s));
    g.gps_stretch.push_back(static_cast<std::size_t>(at_s / params.gps_stretch_s));
    if (g.bias_stretch.back() >= g.start.gyro_bias.size()) {
      g.start.gyro_bias.push_back(b.gyro_bias);
      g.start.accel_bias.push_back(b.accel_bias);
    }
    if (g.gps_stretch.back() >= g.start.gps_bias.size()) {
      g.start.gps_bias.emplace_back(Vec3::Zero());
    }
  }
  set_priors(r, wm, params, &g);
  graph.priors.first_pose = g.start.T_world_vehicle.front();
  if (g.has_world) {
    // GPS is more accurate, except for the tilt of a vehicle without INS on a straight path.
    graph.priors.first_sigma << Vec3::Constant(1e3), 0.1, 0.1, 0.5;
  } else if (!r.inertial.empty()) {
    graph.priors.first_sigma << Vec3::Constant(1e-3), 0.02, 0.02, 1e-3;
  }
  if (r.inertial.empty()) graph.priors.mount_rad = 1e-5;  // the LADAR alone defines the axes
  if (g.has_world) add_fixes(r, wm.gps, &g);
  add_wheels(r, wm.odometry, &g);
  preintegrate_edges(r, g.start, wm, &g);
  return g;
}

void preintegrate_edges(const ReferenceRecording& r, const GraphState& state,
                        const wm::WmParams& wm, ReferenceGraph* g) {
  const InertialNoise noise{wm.ins.angle_random_walk, wm.ins.velocity_random_walk};
  PoseGraph& graph = g->graph;
  graph.inertial.clear();
  graph.motion.clear();
  for (std::size_t n = 0; n + 1 < g->nodes.size(); ++n) {
    InertialEdge e;
    e.from = n;
    e.to = n + 1;
    e.stretch = g->bias_stretch[n];
    const InertialErrors errors{state.gyro_bias[e.stretch], state.accel_bias[e.stretch],
                                state.shared.gyro_scale, state.shared.accel_gain};
    e.motion = preintegrate(r.inertial, g->nodes[n].stamp, g->nodes[n + 1].stamp, errors, noise);
    if (e.motion.dt_s > 0.0) {
      // For the half sample at each end, in which the motion may change.
      e.motion.covariance.diagonal().head<3>().array() += 1e-12;
      e.motion.covariance.diagonal().segment<3>(3).array() += 1e-8;
      e.motion.covariance.diagonal().tail<3>().array() += 1e-8;
      graph.inertial.push_back(e);
      continue;
    }
    MotionEdge m;
    m.from = n;
    m.to = n + 1;
    m.T_from_to = local_pose(r, g->nodes[n].stamp).inverse() * local_pose(r, g->nodes[n + 1].stamp);
    const double moved_m = m.T_from_to.p.norm();
    m.sigma << Vec3::Constant(0.02 + 0.02 * moved_m), Vec3::Constant(0.003 + 0.001 * moved_m);
    graph.motion.push_back(m);
  }
}

LadarDelay measure_ladar_delay(const ReferenceRecording& r, const ReferenceGraph& g,
                               const GraphState& state) {
  // Rotations of three successive scans: the middle one minus the mean of the others is free of
  // drift. e = w * delay + noise, by least squares.
  constexpr double kLongest_s = 0.25;
  constexpr double kWild_rad = 0.03;
  LadarDelay out;
  if (r.inertial.empty()) return out;
  double ww = 0.0;
  double we = 0.0;
  double ee = 0.0;
  for (std::size_t k = 1; k + 1 < r.matches.size(); ++k) {
    const RecordedMatch& a = r.matches[k - 1];
    const RecordedMatch& b = r.matches[k];
    const RecordedMatch& c = r.matches[k + 1];
    const bool together = a.map_epoch == b.map_epoch && b.map_epoch == c.map_epoch &&
                          seconds(c.reference - a.reference) < kLongest_s &&
                          a.reference >= g.nodes.front().stamp &&
                          c.reference <= g.nodes.back().stamp;
    if (!together) continue;
    const Mat3 mount = state.shared.mount.rotation();
    const auto turned = [&](const RecordedMatch& from, const RecordedMatch& to) {
      const Quat q = smoothed_pose(r, g, state, from.reference).q.conjugate() *
                     smoothed_pose(r, g, state, to.reference).q;
      const Quat seen = from.T_rolling_vehicle.q.conjugate() * to.T_rolling_vehicle.q;
      // Both in vehicle axes.
      return Vec3(mount * log_so3(seen) - log_so3(q));
    };
    const Vec3 e = 0.5 * (turned(a, b) - turned(b, c));
    const Vec3 w =
        rate_at(r, b.reference) - 0.5 * (rate_at(r, a.reference) + rate_at(r, c.reference));
    if (e.norm() > kWild_rad) continue;
    ww += w.squaredNorm();
    we += w.dot(e);
    ee += e.squaredNorm();
    ++out.scans;
  }
  if (out.scans < 100 || ww <= 0.0) return out;
  out.delay_s = we / ww;
  const double noise2 = std::max(ee - we * we / ww, 0.0) / (3.0 * static_cast<double>(out.scans));
  // Neighbouring triples share scans.
  out.sigma_s = std::sqrt(2.0 * noise2 / ww);
  return out;
}

Pose smoothed_pose(const ReferenceRecording& r, const ReferenceGraph& g, const GraphState& state,
                   Stamp stamp) {
  const std::size_t n = node_before(g.nodes, stamp);
  const bool inside = n + 1 < g.nodes.size() && stamp >= g.nodes.front().stamp;
  const Pose& T = state.T_world_vehicle[n];
  if (inside) {
    const std::size_t b = g.bias_stretch[n];
    const InertialErrors errors{state.gyro_bias[b], state.accel_bias[b], state.shared.gyro_scale,
                                state.shared.accel_gain};
    const Stamp begin = g.nodes[n].stamp;
    const Stamp end = g.nodes[n + 1].stamp;
    const auto predict = [&](Stamp to) {
      const Preintegrated m = preintegrate(r.inertial, begin, to, errors, {});
      const double dt = m.dt_s;
      const Vec3 p =
          T.p + state.v_world[n] * dt + 0.5 * dt * dt * g.graph.gravity_world + T.q * m.dp;
      return Pose{exp_so3(-g.graph.earth_rate_world * dt) * T.q * m.turn, p};
    };
    if (stamp == begin) return T;
    if (preintegrate(r.inertial, begin, end, errors, {}).dt_s > 0.0) {
      // The remaining error at the next node is distributed over the motion to it.
      const double s = seconds(stamp - begin) / seconds(end - begin);
      const Vec6 left = log_se3(predict(end).inverse() * state.T_world_vehicle[n + 1]);
      return predict(stamp) * exp_se3(s * left);
    }
  }
  const Pose T_local = local_pose(r, stamp);
  const auto from = [&](std::size_t k) {
    return state.T_world_vehicle[k] * (local_pose(r, g.nodes[k].stamp).inverse() * T_local);
  };
  if (!inside) return from(n);
  const double s =
      seconds(stamp - g.nodes[n].stamp) / seconds(g.nodes[n + 1].stamp - g.nodes[n].stamp);
  return interpolate(from(n), from(n + 1), s);
}

}  // namespace rcs::smoothing
