#include "tools/evaluation/evaluation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <iterator>

#include "lcmtypes/rcs/innovation_t.hpp"

namespace rcs::evaluation {
namespace {

/// Between samples of the world error.
constexpr Duration kErrorPeriod = std::chrono::milliseconds(100);
/// A GPS receiver of 1 Hz that loses one fix is not an outage.
constexpr Duration kOutage = std::chrono::milliseconds(2500);
constexpr Duration kMaxTruthGap = std::chrono::milliseconds(500);

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

WorldError world_error(const recording::NavRecord& nav, const Pose& T_truthworld_world,
                       const Pose& truth) {
  WorldError e;
  e.stamp = nav.stamp;
  e.T_truthworld_vehicle = T_truthworld_world * nav.T_world_vehicle;
  e.position_m = e.T_truthworld_vehicle.p - truth.p;
  e.heading_rad = wrap_angle(yaw_of(e.T_truthworld_vehicle.q) - yaw_of(truth.q));
  const WorldSigma sigma = world_sigma(e.T_truthworld_vehicle.rotation(), nav.cov_world_pose);
  e.sigma_m = sigma.position_m;
  e.sigma_horizontal_m = sigma.horizontal_m;
  e.sigma_heading_rad = sigma.heading_rad;
  e.nees = nees(pose_error(e.T_truthworld_vehicle, truth), nav.cov_world_pose);
  return e;
}

NodeMetrics node_metrics(const recording::NodeRecord& node) {
  NodeMetrics f;
  std::vector<double> wall_ms;
  std::vector<double> late_ms;
  std::map<std::string, std::vector<double>> stages_ms;
  for (const recording::CycleRecord& c : node.cycles) {
    wall_ms.push_back(c.wall_ms);
    late_ms.push_back(c.late_ms);
    for (const auto& [stage, ms] : c.stages_ms) stages_ms[stage].push_back(ms);
  }
  f.wall_ms = tools::summarize(std::move(wall_ms));
  f.late_ms = tools::summarize(std::move(late_ms));
  for (auto& [stage, ms] : stages_ms) f.stages_ms[stage] = tools::summarize(std::move(ms));
  f.missed = node.missed;
  f.overruns = node.overruns;
  f.lost = node.lost;
  return f;
}

}  // namespace

WorldSigma world_sigma(const Mat3& R_world_vehicle, const Mat6& cov_world_pose) {
  const Mat3& R = R_world_vehicle;
  const Mat3 P_position = R * cov_world_pose.topLeftCorner<3, 3>() * R.transpose();
  const Mat3 P_attitude = R * cov_world_pose.bottomRightCorner<3, 3>() * R.transpose();
  const Mat<2> P_horizontal = P_position.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Mat<2>> eigen(P_horizontal, Eigen::EigenvaluesOnly);
  WorldSigma sigma;
  sigma.position_m = P_position.diagonal().cwiseMax(0.0).cwiseSqrt();
  sigma.horizontal_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
  sigma.heading_rad = std::sqrt(std::max(0.0, P_attitude(2, 2)));
  return sigma;
}

RunMetrics run_metrics(const recording::RunLog& run) {
  RunMetrics f;
  f.scans = run.scans.size();
  f.prior_matches = run.prior_matches;
  std::vector<double> iterations;
  for (const recording::ScanRecord& scan : run.scans) {
    ++f.stops[std::string(recording::stop_name(scan.stop))];
    iterations.push_back(scan.iterations);
  }
  f.iterations = tools::summarize(std::move(iterations));
  if (!run.scans.empty()) {
    const std::int64_t span = run.scans.back().scan_id - run.scans.front().scan_id + 1;
    f.scans_missing = static_cast<std::size_t>(
        std::max<std::int64_t>(0, span - static_cast<std::int64_t>(f.scans)));
  }
  for (const auto& [name, node] : run.nodes) f.nodes[name] = node_metrics(node);
  if (run.live) {
    Stamp last_cause = from_utime(0);
    for (const recording::NavRecord& nav : run.nav) {
      // Only the first belief that uses a scan; later ones repeat its trace.
      if (nav.cause_arrival <= last_cause) continue;
      last_cause = nav.cause_arrival;
      f.chain_samples_ms.push_back(milliseconds(nav.published - nav.cause_arrival));
    }
    f.chain_ms = tools::summarize(f.chain_samples_ms);
  }
  return f;
}

TrajectoryMetrics trajectory_metrics(const PosePairs& pairs) {
  TrajectoryMetrics f;
  f.pairs = pairs.size();
  if (pairs.size() == 0) return f;
  f.driven_m = tools::distances(pairs.truth).back();
  f.rigid = absolute_error(pairs, align(pairs, Alignment::kRigid));
  f.yaw = absolute_error(pairs, align(pairs, Alignment::kYaw));
  f.unaligned = absolute_error(pairs, Pose{});
  f.drift_percent = drift_percent(pairs);
  f.per_10_frames = relative_error_over_frames(pairs, 10);
  double weight = 0.0;
  for (const double length_m : lengths_that_fit(f.driven_m)) {
    const RelativeError e = relative_error_over_length(pairs, length_m);
    if (e.segments == 0) continue;
    const double n = static_cast<double>(e.segments);
    f.lengths_mean.segments += e.segments;
    f.lengths_mean.translation_percent += n * e.translation_percent;
    f.lengths_mean.rotation_rad_per_m += n * e.rotation_rad_per_m;
    weight += n;
    f.per_length.push_back(e);
  }
  if (weight > 0.0) {
    f.lengths_mean.translation_percent /= weight;
    f.lengths_mean.rotation_rad_per_m /= weight;
  }
  return f;
}

Pose between_worlds(const Geodetic& truth_datum, const Geodetic& world_datum) {
  const LocalFrame truth_frame(truth_datum);
  const LocalFrame world_frame(world_datum);
  const auto moved = [&](const Vec3& p_world) {
    return truth_frame.to_world(world_frame.to_geodetic(p_world));
  };
  constexpr double kBase_m = 1000.0;
  const Vec3 origin = moved(Vec3::Zero());
  Mat3 R;
  for (int i = 0; i < 3; ++i) R.col(i) = (moved(kBase_m * Vec3::Unit(i)) - origin) / kBase_m;
  return {Quat(R).normalized(), origin};
}

void move_between_worlds(const Geodetic& to, const Geodetic& from, tools::Trajectory* poses) {
  if (!plausible(to) || !plausible(from)) return;
  const Pose T_to_from = between_worlds(to, from);
  for (tools::StampedPose& pose : *poses) pose.T = T_to_from * pose.T;
}

std::optional<WorldMetrics> world_metrics(const recording::RunLog& run,
                                          const tools::Trajectory& truth,
                                          const std::optional<Geodetic>& truth_datum) {
  if (truth.empty() || !truth_datum || !run.world_datum) return std::nullopt;
  if (!plausible(*truth_datum) || !plausible(*run.world_datum)) return std::nullopt;
  const Pose T_truthworld_world = between_worlds(*truth_datum, *run.world_datum);
  WorldMetrics f;
  Stamp due = Stamp::min();
  for (const recording::NavRecord& nav : run.nav) {
    if (nav.stamp < due || !nav.world_valid) continue;
    const std::optional<Pose> T = tools::pose_at(truth, nav.stamp, kMaxTruthGap);
    if (!T) continue;
    f.errors.push_back(world_error(nav, T_truthworld_world, *T));
    due = nav.stamp + kErrorPeriod;
  }
  if (f.errors.empty()) return std::nullopt;

  std::vector<double> horizontal_m;
  std::vector<double> vertical_m;
  std::vector<double> heading_rad;
  std::size_t within_horizontal = 0;
  std::size_t within_vertical = 0;
  std::size_t within_heading = 0;
  for (const WorldError& e : f.errors) {
    horizontal_m.push_back(e.horizontal_m());
    vertical_m.push_back(std::abs(e.position_m.z()));
    heading_rad.push_back(std::abs(e.heading_rad));
    if (horizontal_m.back() <= 3.0 * e.sigma_horizontal_m) ++within_horizontal;
    if (vertical_m.back() <= 3.0 * e.sigma_m.z()) ++within_vertical;
    if (heading_rad.back() <= 3.0 * e.sigma_heading_rad) ++within_heading;
    if (e.nees) {
      f.nees_per_dof += *e.nees / 6.0;
      ++f.nees_samples;
    }
  }
  if (f.nees_samples > 0) f.nees_per_dof /= static_cast<double>(f.nees_samples);
  f.not_positive_definite = f.errors.size() - f.nees_samples;
  f.horizontal_within_3_sigma = share(within_horizontal, f.errors.size());
  f.vertical_within_3_sigma = share(within_vertical, f.errors.size());
  f.heading_within_3_sigma = share(within_heading, f.errors.size());
  f.horizontal_m = tools::summarize(std::move(horizontal_m));
  f.vertical_m = tools::summarize(std::move(vertical_m));
  f.heading_rad = tools::summarize(std::move(heading_rad));
  return f;
}

std::vector<TimeInterval> gps_outages(const recording::RunLog& run) {
  std::vector<TimeInterval> outages;
  bool open = false;
  for (const recording::NavRecord& nav : run.nav) {
    const bool out = nav.age_gps > kOutage;
    if (out && !open) outages.push_back({nav.stamp - nav.age_gps, nav.stamp});
    if (open) outages.back().to = out ? nav.stamp : nav.stamp - nav.age_gps;
    open = out;
  }
  return outages;
}

std::vector<TimeInterval> common_intervals(const std::vector<TimeInterval>& a,
                                           const std::vector<TimeInterval>& b) {
  std::vector<TimeInterval> common;
  for (const TimeInterval& i : a) {
    for (const TimeInterval& j : b) {
      const TimeInterval both{std::max(i.from, j.from), std::min(i.to, j.to)};
      if (both.from < both.to) common.push_back(both);
    }
  }
  return common;
}

std::vector<std::string> fused_sources(const recording::RunLog& run, const TimeInterval& interval) {
  const auto within = [&](Stamp t) { return t > interval.from && t < interval.to; };
  const auto fused = [&](std::initializer_list<std::int8_t> sources) {
    return std::any_of(run.fused.begin(), run.fused.end(), [&](const recording::FusedRecord& r) {
      return within(r.stamp) &&
             std::find(sources.begin(), sources.end(), r.source) != sources.end();
    });
  };
  constexpr Duration kFresh = std::chrono::seconds(1);
  const bool ins =
      std::any_of(run.nav.begin(), run.nav.end(), [&](const recording::NavRecord& nav) {
        return within(nav.stamp) && nav.age_ins >= Duration::zero() && nav.age_ins <= kFresh;
      });
  using I = innovation_t;
  const std::pair<bool, const char*> named[] = {
      {fused({I::SOURCE_GPS_POSITION, I::SOURCE_GPS_VELOCITY}), "GPS"},
      {fused({I::SOURCE_ROLLING}), "LADAR"},
      {fused({I::SOURCE_PRIOR_MAP}), "a priori map"},
      {fused({I::SOURCE_ODOMETRY}), "wheel encoders"},
      {ins, "INS"},
      {fused({I::SOURCE_NON_HOLONOMIC, I::SOURCE_ZERO_VELOCITY}), "motion constraints"}};
  std::vector<std::string> names;
  for (const auto& [is_fused, name] : named) {
    if (is_fused) names.emplace_back(name);
  }
  return names;
}

OutageMetrics outage_metrics(const WorldMetrics& metrics, const TimeInterval& outage) {
  OutageMetrics f;
  f.interval = outage;
  const WorldError* last = nullptr;
  std::vector<double> horizontal_m;
  double nees_sum = 0.0;
  std::size_t nees_samples = 0;
  for (const WorldError& e : metrics.errors) {
    if (!outage.contains(e.stamp)) continue;
    horizontal_m.push_back(e.horizontal_m());
    if (last == nullptr) {
      f.start_horizontal_m = e.horizontal_m();
    } else {
      // Along the truth: the estimate minus its error.
      f.driven_m += ((e.T_truthworld_vehicle.p - e.position_m) -
                     (last->T_truthworld_vehicle.p - last->position_m))
                        .norm();
    }
    if (e.nees) {
      nees_sum += *e.nees / 6.0;
      ++nees_samples;
    }
    last = &e;
  }
  f.horizontal_m = tools::summarize(std::move(horizontal_m));
  if (last != nullptr) f.end_horizontal_m = last->horizontal_m();
  if (f.driven_m > 0.0) f.drift_percent = 100.0 * f.end_horizontal_m / f.driven_m;
  if (nees_samples > 0) f.nees_per_dof = nees_sum / static_cast<double>(nees_samples);
  return f;
}

}  // namespace rcs::evaluation
