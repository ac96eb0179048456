// Aiding sources that a configuration switches off: the baselines of a comparison.
#include <gtest/gtest.h>

#include <map>

#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

// No measurement of a source that a baseline omits is accepted.
TEST(EstimatorAids, AnAidThatIsSwitchedOffIsNotFused) {
  const auto accepted = [](const WmParams& params) {
    Experiment experiment;
    experiment.params = params;
    experiment.drive.length_s = 20.0;
    Rig rig(experiment);
    std::map<Source, int> count;
    for (std::size_t i = 1; i < rig.truth.size(); ++i) {
      rig.estimator.add(rig.sensors.imu(i));
      if (i % 20 == 0) rig.estimator.add(rig.truth[i].stamp, rig.sensors.gps(i));
      if (i % 5 == 0) rig.estimator.add(rig.truth[i].stamp, rig.sensors.odometry(i));
      if (i % 10 != 0) continue;
      rig.estimator.fuse();
      for (const Innovation& k : rig.estimator.innovations()) {
        if (k.reason == Reason::kAccepted) ++count[k.source];
      }
      rig.estimator.clear_innovations();
    }
    return count;
  };
  std::map<Source, int> all = accepted({});
  for (const Source s : {Source::kOdometry, Source::kNonHolonomic, Source::kZeroVelocity}) {
    EXPECT_GT(all[s], 0) << static_cast<int>(s);
  }
  WmParams params;
  params.odometry.constrained = false;
  params.odometry.zero_velocity = false;
  std::map<Source, int> without = accepted(params);
  EXPECT_EQ(without[Source::kNonHolonomic], 0);
  EXPECT_EQ(without[Source::kZeroVelocity], 0);
  EXPECT_GT(without[Source::kGpsPosition], 0);
  EXPECT_GT(without[Source::kOdometry], 0) << "wheel speeds need no constraint";
}

}  // namespace
}  // namespace rcs::wm
