#include "tests/wm/estimator_rig.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rcs::wm {

Score run(const Experiment& experiment) {
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  Score score;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    if (experiment.ins) estimator.add(sensors.imu(i));
    const bool outage = t >= experiment.outage_from_s && t < experiment.outage_to_s;
    if (i % 20 == 0) {
      const GeodeticFix fix = sensors.gps(i);
      if (experiment.gps && !outage) estimator.add(now, fix);
    }
    if (experiment.ladar && i % 10 == 0) estimator.add(now, sensors.scan(i));
    if (experiment.odometry && i % 5 == 0) estimator.add(now, sensors.odometry(i));
    if (i % 10 != 0) continue;
    estimator.fuse();
    for (const Innovation& k : estimator.innovations()) {
      (k.reason == Reason::kGate ? score.refused : score.accepted) += 1;
    }
    estimator.clear_innovations();
    if (!estimator.started()) continue;
    const FilterState& s = estimator.state();
    if (s.bookkeeping.georeferenced && score.georeferenced_s < 0.0) score.georeferenced_s = t;
    const Truth& at = truth[i];
    if (s.belief.x.stamp != at.stamp) continue;
    const Pose& T = s.belief.x.T_world_vehicle;
    const Vec6 e = log_se3(T.inverse() * at.T_world_vehicle);
    if (s.bookkeeping.georeferenced) {
      score.worst_error_m = std::max(score.worst_error_m, e.head<3>().norm());
    }
    if (s.bookkeeping.georeferenced && i % 100 == 0) {
      score.nees_pose += e.dot(world_pose_covariance(s.belief, 0.0).llt().solve(e)) / 6.0;
      ++score.samples;
    }
  }
  score.nees_pose /= std::max(1, score.samples);
  const FilterState& s = estimator.state();
  const Pose& T = s.belief.x.T_world_vehicle;
  score.error_m = (T.p - truth.back().T_world_vehicle.p).norm();
  score.height_error_m = std::abs(T.p.z() - truth.back().T_world_vehicle.p.z());
  score.heading_error_rad =
      std::abs(wrap_angle(yaw_of(T.q) - yaw_of(truth.back().T_world_vehicle.q)));
  score.sigma_m = std::sqrt(s.belief.P(0, 0) + s.belief.P(1, 1));
  score.resets = s.bookkeeping.world_resets;
  score.georeferenced = s.bookkeeping.georeferenced;
  score.mode = estimator.mode();
  return score;
}

}  // namespace rcs::wm
