#include "tools/smoothing/reference_output.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "tools/evaluation/trajectory_error.h"
#include "tools/report/table.h"

namespace rcs::smoothing {
namespace {

constexpr Duration kMaxTruthGap = std::chrono::milliseconds(200);

std::size_t nearest_node(const ReferenceGraph& g, Stamp stamp) {
  const auto after = std::lower_bound(g.nodes.begin(), g.nodes.end(), stamp,
                                      [](const ReferenceNode& n, Stamp t) { return n.stamp < t; });
  const auto k = static_cast<std::size_t>(after - g.nodes.begin());
  if (k == 0) return 0;
  if (k == g.nodes.size()) return k - 1;
  return g.nodes[k].stamp - stamp < stamp - g.nodes[k - 1].stamp ? k : k - 1;
}

Vec6 sigmas(const Mat6& P) { return P.diagonal().cwiseMax(0.0).cwiseSqrt(); }

ReferenceErrors errors_of(const evaluation::PosePairs& pairs) {
  ReferenceErrors e;
  e.poses = pairs.size();
  const double n = static_cast<double>(pairs.size());
  const Pose A = evaluation::align(pairs, evaluation::Alignment::kRigid);
  const evaluation::AbsoluteError error = evaluation::absolute_error(pairs, A);
  e.position_m = error.translation_m.rms;
  e.horizontal_m = error.horizontal_m.rms;
  e.vertical_m = error.vertical_m.rms;
  e.position_max_m = error.translation_m.max;
  e.rotation_deg = degrees(error.rotation_rad.rms);
  Vec3 mean = Vec3::Zero();
  std::vector<Quat> turned;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    turned.push_back((A.q * pairs.estimate[k].q).conjugate() * pairs.truth[k].q);
    mean += log_so3(turned.back()) / n;
    e.offset_m += (pairs.truth[k].p - pairs.estimate[k].p) / n;
  }
  double sum = 0.0;
  for (const Quat& q : turned) sum += log_so3(q * exp_so3(-mean)).squaredNorm() / n;
  e.mounting_deg = mean * degrees(1.0);
  e.rotation_less_mounting_deg = degrees(std::sqrt(sum));
  return e;
}

std::string number(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

nlohmann::ordered_json to_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

nlohmann::ordered_json to_json(const ReferenceErrors& e) {
  return {{"poses", e.poses},
          {"position_rms_m", e.position_m},
          {"horizontal_rms_m", e.horizontal_m},
          {"vertical_rms_m", e.vertical_m},
          {"position_max_m", e.position_max_m},
          {"rotation_rms_deg", e.rotation_deg},
          {"mounting_deg", to_json(e.mounting_deg)},
          {"rotation_less_mounting_rms_deg", e.rotation_less_mounting_deg},
          {"offset_m", to_json(e.offset_m)}};
}

nlohmann::ordered_json to_json(const MapResidual& r) {
  return {{"rms_m", r.rms_m}, {"median_m", r.median_m}, {"share", r.share}, {"points", r.points}};
}

}  // namespace

std::vector<ReferencePose> reference_poses(const ReferenceRecording& r,
                                           const ReferenceResult& result) {
  std::vector<ReferencePose> poses;
  const ReferenceGraph& g = result.graph;
  const GraphState& state = result.solved.state;
  const SharedErrors& shared = state.shared;
  const Duration delay = from_seconds(shared.ladar_delay_s);
  for (const RecordedScan& scan : r.scans) {
    if (scan.reference < g.nodes.front().stamp || scan.reference > r.beliefs.back().stamp) continue;
    const std::size_t n = nearest_node(g, scan.reference);
    ReferencePose p;
    p.stamp = scan.reference;
    p.T = smoothed_pose(r, g, state, scan.reference);
    p.T_seen = smoothed_pose(r, g, state, scan.reference + delay) * shared.mount;
    // The uncertainty of the LADAR clock shifts the poses along the motion.
    Vec6 more = Vec6::Zero();
    more.head<3>() = (g.graph.twist[n].head<3>() * result.delay.sigma_s).cwiseAbs2();
    p.absolute = sigmas(result.covariance.pose[n] + Mat6(more.asDiagonal()));
    p.from_first = sigmas(result.covariance.from_first[n] + Mat6(more.asDiagonal()));
    poses.push_back(p);
  }
  return poses;
}

ReferenceReport report_reference(const ReferenceRecording& r, const ReferenceResult& result,
                                 const std::vector<ReferencePose>& poses) {
  ReferenceReport report;
  const ReferenceGraph& g = result.graph;
  report.frame = g.has_world ? "world" : "local";
  report.scans = r.scans.size();
  report.poses = poses.size();
  report.travelled_m = g.travelled_m.back();
  evaluation::PosePairs smoothed;
  evaluation::PosePairs before;
  for (const ReferencePose& p : poses) {
    const std::optional<Pose> truth = tools::pose_at(r.sim_truth, p.stamp, kMaxTruthGap);
    if (!truth) continue;
    smoothed.stamps.push_back(p.stamp);
    smoothed.estimate.push_back(p.T);
    smoothed.truth.push_back(*truth);
  }
  if (smoothed.size() < 3) return report;
  for (std::size_t n = 0; n < g.nodes.size(); ++n) {
    const std::optional<Pose> truth = tools::pose_at(r.sim_truth, g.nodes[n].stamp, kMaxTruthGap);
    if (!truth) continue;
    before.stamps.push_back(g.nodes[n].stamp);
    before.estimate.push_back(g.start.T_world_vehicle[n]);
    before.truth.push_back(*truth);
  }
  ReferenceErrors e = errors_of(smoothed);
  e.offset_squared = e.offset_m.dot(result.covariance.offset.ldlt().solve(e.offset_m).eval());
  report.errors = e;
  if (before.size() >= 3) report.errors_before = errors_of(before);
  return report;
}

std::string format_sigmas(const std::vector<ReferencePose>& poses) {
  std::string text =
      "t_s,sigma_x_m,sigma_y_m,sigma_z_m,sigma_roll_rad,sigma_pitch_rad,sigma_yaw_rad,"
      "since_first_x_m,since_first_y_m,since_first_z_m,since_first_roll_rad,"
      "since_first_pitch_rad,since_first_yaw_rad\n";
  for (const ReferencePose& p : poses) {
    text += fmt::format("{:.6f}", 1e-6 * static_cast<double>(to_utime(p.stamp)));
    for (const double s : p.absolute) text += fmt::format(",{:.6g}", s);
    for (const double s : p.from_first) text += fmt::format(",{:.6g}", s);
    text += '\n';
  }
  return text;
}

nlohmann::ordered_json to_json(const ReferenceReport& report, const ReferenceResult& result) {
  nlohmann::ordered_json j;
  const SharedErrors& shared = result.solved.state.shared;
  j["frame"] = report.frame;
  j["scans"] = report.scans;
  j["poses"] = report.poses;
  j["nodes"] = result.graph.nodes.size();
  j["travelled_m"] = report.travelled_m;
  j["converged"] = result.solved.converged;
  for (std::size_t k = 0; k < kEdgeKinds; ++k) {
    const KindFit& fit = result.solved.fit[k];
    if (fit.edges == 0) continue;
    j["edges"][std::string(name_of(static_cast<EdgeKind>(k)))] = {
        {"edges", fit.edges},
        {"chi2_per_dof", fit.chi2 / fit.dof},
        {"median_chi2_per_dof", fit.median_per_dof},
        {"suspect", fit.suspect},
        {"variance_factor", result.graph.graph.variance_factor[k]}};
  }
  for (const ReferenceRound& round : result.rounds) {
    j["rounds"].push_back({{"consecutive_tried", round.consecutive.tried},
                           {"consecutive_matched", round.consecutive.made},
                           {"revisits_tried", round.revisit.tried},
                           {"revisits_matched", round.revisit.made},
                           {"moved_rms_m", round.moved_m}});
  }
  j["map_residual_before"] = to_json(result.residual_before);
  j["map_residual_after"] = to_json(result.residual_after);
  if (report.frame == "world") {
    j["absolute_offset_sigma_m"] = to_json(Vec3(result.covariance.offset.diagonal().cwiseSqrt()));
  }
  j["ladar_delay_ms"] = 1e3 * shared.ladar_delay_s;
  j["ladar_delay_sigma_ms"] = 1e3 * result.delay.sigma_s;
  j["ladar_misalignment_deg"] = to_json(Vec3(log_so3(shared.mount.q) * degrees(1.0)));
  j["wheel_scale"] = shared.wheel_scale;
  if (report.errors_before) j["errors_before"] = to_json(*report.errors_before);
  if (report.errors) {
    j["errors"] = to_json(*report.errors);
    j["errors"]["offset_squared_by_its_covariance"] = report.errors->offset_squared;
    j["errors"]["offset_within_95_percent"] = report.errors->offset_squared < 7.815;
  }
  return j;
}

std::string to_text(const ReferenceReport& report, const ReferenceResult& result) {
  std::string text =
      fmt::format("{} poses in frame {}, {} poses in the graph, {:.0f} m\n", report.poses,
                  report.frame, result.graph.nodes.size(), report.travelled_m);
  report::Table edges{{"measurements", "count", "chi2/dof", "median", "suspect", "variance x"}, {}};
  for (std::size_t k = 0; k < kEdgeKinds; ++k) {
    const KindFit& fit = result.solved.fit[k];
    if (fit.edges == 0) continue;
    edges.rows.push_back({std::string(name_of(static_cast<EdgeKind>(k))), std::to_string(fit.edges),
                          number(fit.chi2 / fit.dof, 2), number(fit.median_per_dof, 2),
                          std::to_string(fit.suspect),
                          number(result.graph.graph.variance_factor[k], 2)});
  }
  edges.note =
      "chi2/dof: squared residual over its predicted variance, per degree of freedom, 1 if "
      "consistent; suspect: residuals with a reduced weight; variance x: factor on the predicted "
      "variance; prior: of the first pose and of the sensor errors";
  text += '\n' + to_text(edges);
  if (!result.rounds.empty()) {
    const ReferenceRound& last = result.rounds.back();
    text += fmt::format("revisits: {} tried, {} matched, {} of them suspect\n", last.revisit.tried,
                        last.revisit.made,
                        result.solved.fit[static_cast<std::size_t>(EdgeKind::kRevisit)].suspect);
  }
  text += fmt::format(
      "scans against their common map: {:.1f} cm RMS, {:.0f} % of the points near it; with the "
      "poses of WM {:.1f} cm, {:.0f} %\n",
      100.0 * result.residual_after.rms_m, 100.0 * result.residual_after.share,
      100.0 * result.residual_before.rms_m, 100.0 * result.residual_before.share);
  if (report.frame == "world") {
    const Vec3 s = result.covariance.offset.diagonal().cwiseSqrt();
    text += fmt::format("common absolute offset: sigma {:.2f} {:.2f} {:.2f} m east, north, up\n",
                        s.x(), s.y(), s.z());
  } else {
    text += "no GPS: the poses are in frame local of WM\n";
  }
  if (result.delay.sigma_s > 0.0) {
    text += fmt::format("LADAR clock: scans are {:.1f} ms (sigma {:.1f} ms) {} their stamps\n",
                        1e3 * std::abs(result.delay.delay_s), 1e3 * result.delay.sigma_s,
                        result.delay.delay_s < 0.0 ? "before" : "after");
  }
  if (!report.errors) return text;
  report::Table errors{{"against SIM_TRUTH, aligned over SE(3)", "RMS [cm]", "horizontal",
                        "vertical", "max", "rotation [deg]", "less its mean"},
                       {}};
  const auto add = [&errors](const char* what, const ReferenceErrors& e) {
    errors.rows.push_back({what, number(100 * e.position_m, 1), number(100 * e.horizontal_m, 1),
                           number(100 * e.vertical_m, 1), number(100 * e.position_max_m, 1),
                           number(e.rotation_deg, 3), number(e.rotation_less_mounting_deg, 3)});
  };
  if (report.errors_before) add("WM online", *report.errors_before);
  add("smoothed", *report.errors);
  const Vec3& o = report.errors->offset_m;
  text += '\n' + to_text(errors);
  text +=
      fmt::format("not aligned: mean error {:.2f} {:.2f} {:.2f} m, {} its 95 % ellipsoid\n", o.x(),
                  o.y(), o.z(), report.errors->offset_squared < 7.815 ? "within" : "outside of");
  return text;
}

}  // namespace rcs::smoothing
