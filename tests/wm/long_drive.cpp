#include "tests/wm/long_drive.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "modules/wm/estimator.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {

double smallest_eigenvalue(const Cov& P) {
  return Eigen::SelfAdjointEigenSolver<Cov>(P, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

void expect_covariance_stays_sound(double length_s, std::size_t check_every) {
  WmParams params;
  DriveScript script;
  script.length_s = length_s;
  const std::vector<Truth> truth = make_drive(script);
  Sensors sensors(truth, params, {});
  Estimator estimator(params, test_datum());
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    if (i % 100 == 0) estimator.add(truth[i].stamp, sensors.gps(i));
    if (i % 10 == 0) estimator.add(truth[i].stamp, sensors.scan(i));
    if (i % 10 == 5) estimator.add(truth[i].stamp, sensors.odometry(i));
    if (i % 10 == 0) estimator.fuse();
    estimator.clear_innovations();
    if (i % check_every != 0 || !estimator.started()) continue;
    const Cov& P = estimator.state().belief.P;
    ASSERT_TRUE(P.allFinite());
    ASSERT_LT((P - P.transpose()).cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_GT(smallest_eigenvalue(P), -1e-9 * P.diagonal().maxCoeff());
  }
  const Pose& T = estimator.state().belief.x.T_world_vehicle;
  EXPECT_LT((T.p - truth.back().T_world_vehicle.p).norm(), 2.0);
}

}  // namespace rcs::wm
