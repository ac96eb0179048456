// A LADAR with larger errors than its registrations state, as in high grass: the INS is not
// excluded, and the measured scale of the errors does not depend on the order of arrival.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

/// Errors that all scans of a second have in common.
Vec3 wandering(double t_s) { return {0.5 * std::sin(1.6 * t_s), 0.3 * std::sin(1.3 * t_s), 0.0}; }

TEST(PoorLadar, TheInsIsNotExcluded) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0; };
  d.match_off = [](double t) { return t < 20.0 ? Vec3(Vec3::Zero()) : wandering(t); };
  int outside = 0;
  int samples = 0;
  for (unsigned seed = 1; seed <= 18; ++seed) {
    const Seen seen = drive(75.0, d, seed);
    outside += seen.beyond_protection;
    samples += seen.samples;
    std::printf("seed %u: worst %.2f m, outside of the protection level %d of %d\n", seed,
                seen.worst_m, seen.beyond_protection, seen.samples);
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << "seed " << seed;
    EXPECT_LT(seen.worst_m, 5.0) << "seed " << seed;  // 4.6 m in 40 seeds
  }
  EXPECT_LE(outside, 0.001 * samples);  // the level is one of 99.9 %
}

TEST(PoorLadar, NoOtherSourceIsExcludedForScansThatMove) {
  for (const double rate_mps : {1.0, 2.0, 4.0}) {
    Disturbance d;
    d.match_off = [rate_mps](double t) -> Vec3 {
      return Vec3(0.6, -0.8, 0.0) * rate_mps * std::max(0.0, t - 30.0);
    };
    const Seen seen = drive(60.0, d);
    std::printf("%.1f m/s: worst %.2f m\n", rate_mps, seen.worst_m);
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << rate_mps;
    EXPECT_FALSE(seen.found(Finding::kGpsFaulty)) << rate_mps;
    EXPECT_LT(seen.worst_m, 2.0) << rate_mps;
  }
}

/// The belief at the end of a drive with a poor LADAR.
/// @param late_s  by which scans and wheel speeds arrive late
Belief belief_after(double late_s) {
  const WmParams params;
  DriveScript script;
  script.length_s = 40.0;
  const std::vector<Truth> truth = make_drive(script);
  Sensors sensors(truth, params, SensorScript{});
  Estimator estimator(params, test_datum());
  struct Late {
    Stamp stamp;
    bool scan;
    RollingMatch match;
    OdometrySample odometry;
  };
  std::vector<Late> waiting;
  const auto deliver = [&](Stamp until) {
    std::size_t k = 0;
    for (; k < waiting.size() && waiting[k].stamp <= until; ++k) {
      if (waiting[k].scan) {
        estimator.add(waiting[k].stamp, waiting[k].match);
      } else {
        estimator.add(waiting[k].stamp, waiting[k].odometry);
      }
    }
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(k));
  };
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    estimator.add(sensors.imu(i));
    if (i % 20 == 0) estimator.add(now, sensors.gps(i));
    if (i % 10 == 0) {
      RollingMatch match = sensors.scan(i);
      match.T_rolling_vehicle.p += wandering(t);
      waiting.push_back({now, true, match, {}});
    }
    if (i % 5 == 0) waiting.push_back({now, false, {}, sensors.odometry(i)});
    deliver(now - from_seconds(t < 10.0 ? 0.0 : late_s));
    estimator.fuse();
  }
  deliver(Stamp::max());
  estimator.fuse();
  EXPECT_GT(estimator.fault_detection().ladar_scale().position, 2.0) << "a scale is in use";
  return estimator.state().belief;
}

TEST(PoorLadar, TheScaleDoesNotDependOnTheOrderOfArrival) {
  const Belief in_time = belief_after(0.0);
  const Belief late = belief_after(0.3);
  EXPECT_EQ(in_time.x.stamp, late.x.stamp);
  EXPECT_LT((in_time.x.T_world_vehicle.p - late.x.T_world_vehicle.p).norm(), 1e-9);
  EXPECT_LT((in_time.P - late.P).norm(), 1e-9);
}

}  // namespace
}  // namespace rcs::wm
