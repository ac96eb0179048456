// Faulty sources are detected and excluded, the filter is rolled back, and sources without fault
// are readmitted. On synthetic drives; `rcs drill` tests it on whole ones.
#include <gtest/gtest.h>

#include <functional>

#include "modules/wm/alignment.h"
#include "modules/wm/estimator.h"
#include "modules/wm/integrity.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

struct Disturbance {
  std::function<Vec3(double t_s)> fix_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<Vec3(double t_s)> velocity_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<bool(double t_s)> has_fix = [](double) { return true; };
  std::function<Vec3(double t_s)> match_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<Vec3(double t_s)> map_off;  ///< empty: there is no a priori map
};

struct Seen {
  std::vector<std::pair<double, Finding>> findings;
  double first_alert_s = -1.0;  ///< ALERT_GPS
  double first_ladar_alert_s = -1.0;
  double worst_m = 0.0;             ///< horizontal error, after the first 20 s
  double worst_local_step_m = 0.0;  ///< in addition to the motion
  double end_m = 0.0;               ///< error at the end
  int beyond_protection = 0;        ///< samples after 20 s
  int samples = 0;
  Trusted gps = Trusted::kNone;  ///< at the end
  Trusted ladar = Trusted::kNone;

  [[nodiscard]] bool found(Finding what) const {
    return std::any_of(findings.begin(), findings.end(),
                       [what](const auto& f) { return f.second == what; });
  }
};

Seen drive(double length_s, const Disturbance& d, unsigned seed = 1) {
  WmParams params;
  DriveScript script;
  script.length_s = length_s;
  const std::vector<Truth> truth = make_drive(script);
  SensorScript sensed;
  sensed.seed = seed;
  Sensors sensors(truth, params, sensed);
  Estimator estimator(params, test_datum());
  const LocalFrame frame(test_datum());
  Seen seen;
  int findings = 0;
  Pose local_before;
  Pose true_before;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    estimator.add(sensors.imu(i));
    if (i % 20 == 0) {
      GeodeticFix fix = sensors.gps(i);
      fix.antenna = frame.to_geodetic(frame.to_world(fix.antenna) + d.fix_off(t));
      fix.fix.v_world += d.velocity_off(t);
      if (d.has_fix(t)) estimator.add(now, fix);
    }
    if (i % 10 == 0) {
      RollingMatch match = sensors.scan(i);
      match.T_rolling_vehicle.p += d.match_off(t);
      estimator.add(now, match);
    }
    if (d.map_off && i % 10 == 0) estimator.add(now, sensors.prior(i, d.map_off(t)));
    if (i % 5 == 0) estimator.add(now, sensors.odometry(i));
    estimator.fuse();
    estimator.clear_innovations();
    if (estimator.trust().findings() != findings) {
      findings = estimator.trust().findings();
      seen.findings.emplace_back(t, estimator.trust().newest_finding());
      const Finding newest = seen.findings.back().second;
      const double ratio = estimator.trust().finding_ratio();
      std::printf("%.1f s: finding %d, test ratio %.2f, moved by %.2f m\n", t,
                  static_cast<int>(newest), ratio, estimator.trust().finding_moved_m());
      if (newest == Finding::kGpsGuilty || newest == Finding::kLadarGuilty ||
          newest == Finding::kMapGuilty) {
        EXPECT_GT(ratio, 1.0);  // what an event reports as the cause
        EXPECT_GT(estimator.trust().finding_moved_m(), 0.0);
      }
    }
    if (i % 10 != 0 || !estimator.started() || !estimator.state().memory.anchored) continue;
    const FilterState& s = estimator.state();
    const Integrity told = integrity(s, estimator.trust(), Duration::zero(), params);
    const double error =
        (s.belief.x.T_world_vehicle.p - truth[i].T_world_vehicle.p).head<2>().norm();
    const Pose local_moved = local_before.inverse() * estimator.T_local_vehicle();
    const Pose moved = true_before.inverse() * truth[i].T_world_vehicle;
    local_before = estimator.T_local_vehicle();
    true_before = truth[i].T_world_vehicle;
    seen.end_m = error;
    if (t < 20.0) continue;
    if ((told.alerts & kAlertGps) != 0 && seen.first_alert_s < 0.0) seen.first_alert_s = t;
    if ((told.alerts & kAlertLadar) != 0 && seen.first_ladar_alert_s < 0.0) {
      seen.first_ladar_alert_s = t;
    }
    seen.worst_m = std::max(seen.worst_m, error);
    seen.worst_local_step_m = std::max(seen.worst_local_step_m, (local_moved.p - moved.p).norm());
    seen.beyond_protection += error > told.protection_horizontal_m ? 1 : 0;
    ++seen.samples;
  }
  seen.gps = estimator.trust().gps(estimator.state(), params.modes);
  seen.ladar = estimator.trust().ladar(estimator.state(), params.modes);
  return seen;
}

TEST(FaultDetection, NoFaultIsDetectedInACleanDrive) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Seen seen = drive(90.0, {}, seed);
    EXPECT_TRUE(seen.findings.empty()) << "seed " << seed;
    EXPECT_LT(seen.first_alert_s, 0.0) << "seed " << seed;
    EXPECT_LT(seen.first_ladar_alert_s, 0.0) << "seed " << seed;
    EXPECT_EQ(seen.beyond_protection, 0) << "seed " << seed;
    EXPECT_EQ(seen.gps, Trusted::kFully);
  }
}

TEST(FaultDetection, NoSubFilterBeforeHeadingAndTiltAreKnown) {
  const Model model{WmParams{}};
  const Stamp now = from_utime(1'000'000'000);
  const auto watched = [&](bool inertial, int badly_known) {
    FilterState s{initial_belief(model.params, now), {}};
    s.belief.x.inertial = inertial;
    s.belief.P.diagonal().segment<3>(kAttitude).setConstant(1e-6);
    s.belief.P(kAttitude + badly_known, kAttitude + badly_known) = 4e-4;
    s.memory.anchored = true;
    s.memory.of(Source::kGpsPosition).accepted = now;
    Trust trust(model.params.trust);
    EXPECT_FALSE(trust.add(model, {now, OdometrySample{}}, nullptr, s).has_value());
    return trust.subfilter(Without::kGps).alive();
  };
  const double limit = model.params.trust.attitude_sigma_rad;
  ASSERT_GT(4e-4, limit * limit);
  for (const bool inertial : {true, false}) EXPECT_FALSE(watched(inertial, 2));
  // A tilt error makes the INS diverge by gravity; a path by the LADAR alone is only rotated.
  for (const int tilt : {0, 1}) {
    EXPECT_FALSE(watched(true, tilt));
    EXPECT_TRUE(watched(false, tilt));
  }
}

TEST(FaultDetection, ARampIsDetectedAndRolledBack) {
  for (const double rate_mps : {0.25, 0.5, 1.0, 5.0}) {
    Disturbance d;
    d.fix_off = [rate_mps](double t) { return Vec3(std::max(0.0, t - 40.0) * rate_mps, 0.0, 0.0); };
    d.velocity_off = [rate_mps](double t) { return Vec3(t > 40.0 ? rate_mps : 0.0, 0.0, 0.0); };
    const Seen seen = drive(90.0, d);
    EXPECT_GT(seen.first_alert_s, 40.0) << rate_mps;
    EXPECT_LT(seen.first_alert_s, rate_mps < 0.5 ? 65.0 : 55.0) << rate_mps;
    EXPECT_LT(seen.worst_m, 4.0) << rate_mps;
    EXPECT_LT(seen.end_m, 2.5) << rate_mps;
    EXPECT_EQ(seen.gps, Trusted::kQuarantine) << rate_mps;
    EXPECT_LT(seen.worst_local_step_m, 0.2)
        << rate_mps;  // in 100 ms, including the noise of the true motion
  }
}

TEST(FaultDetection, AJumpIsRejectedAndReadmissionIsQuick) {
  Disturbance d;
  d.fix_off = [](double t) { return Vec3(0.0, t > 40.0 && t < 50.0 ? 25.0 : 0.0, 0.0); };
  const Seen seen = drive(70.0, d);
  EXPECT_LT(seen.worst_m, 1.5);
  ASSERT_TRUE(seen.found(Finding::kGpsBack));
  EXPECT_NEAR(seen.findings.back().first, 52.5, 2.5);
  EXPECT_EQ(seen.gps, Trusted::kFully);
}

TEST(FaultDetection, AConsistentClusterAtAWrongPositionIsRejectedAfterAnOutage) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0 || t > 60.0; };
  d.fix_off = [](double t) { return Vec3(t > 60.0 && t < 80.0 ? 50.0 : 0.0, 0.0, 0.0); };
  const Seen seen = drive(95.0, d);
  EXPECT_LT(seen.worst_m, 3.0);
  EXPECT_EQ(seen.beyond_protection, 0);
  EXPECT_FALSE(seen.found(Finding::kGpsRight));
  EXPECT_TRUE(seen.found(Finding::kGpsBack));
  EXPECT_EQ(seen.gps, Trusted::kFully);
}

TEST(FaultDetection, FixesAfterAnOutageAreQuarantinedAndThenReadmitted) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0 || t > 60.0; };
  const Seen seen = drive(75.0, d);
  ASSERT_TRUE(seen.found(Finding::kGpsBack));
  EXPECT_LT(seen.findings.back().first, 65.0);
  EXPECT_EQ(seen.gps, Trusted::kFully);
}

TEST(FaultDetection, AHeightFromAnotherGeoidExcludesTheHeightOnly) {
  Disturbance d;
  d.fix_off = [](double t) { return Vec3(0.0, 0.0, t > 40.0 ? 33.0 : 0.0); };
  const Seen seen = drive(70.0, d);
  EXPECT_EQ(seen.gps, Trusted::kFully);
  EXPECT_GT(seen.first_alert_s, 40.0);
  EXPECT_LT(seen.worst_m, 1.5);
}

TEST(FaultDetection, ADriftingLadarIsExcludedAfterAnOutage) {
  // GIVEN matches that lose 20 % of the distance in small steps: no gate detects it.
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0; };
  d.match_off = [](double t) { return Vec3(std::max(0.0, t - 35.0) * 0.4, 0.0, 0.0); };
  const Seen seen = drive(75.0, d);
  EXPECT_GT(seen.first_ladar_alert_s, 35.0);
  EXPECT_LT(seen.worst_m, 8.0);
}

TEST(FaultDetection, AFaultyMapIsExcludedAfterAnOutageAndGpsIsNot) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
  d.map_off = [](double t) { return Vec3(0.8 * std::max(0.0, t - 35.0), 0.0, 0.0); };
  const Seen seen = drive(85.0, d);
  EXPECT_TRUE(seen.found(Finding::kMapGuilty));
  EXPECT_FALSE(seen.found(Finding::kGpsGuilty));
  EXPECT_FALSE(seen.found(Finding::kLadarGuilty));
  EXPECT_EQ(seen.gps, Trusted::kFully);
  EXPECT_LT(seen.end_m, 1.0);
}

TEST(FaultDetection, ACorrectMapIsKept) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Disturbance d;
    d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
    d.map_off = [](double) { return Vec3(0.5, -0.5, 0.3); };
    const Seen seen = drive(85.0, d, seed);
    EXPECT_FALSE(seen.found(Finding::kMapGuilty)) << "seed " << seed;
    EXPECT_LT(seen.worst_m, 1.5) << "seed " << seed;
  }
}

TEST(GpsSigma, IsBoundedBelowByFixTypeAndGeometry) {
  using Fix = GpsQuality::Fix;
  const Vec3 claims = Vec3::Constant(0.02);
  EXPECT_FALSE(worth(claims, {Fix::kFloat, 3, 1.0, 1.6}));
  EXPECT_GT((*worth(claims, {Fix::kSingle, 9, 1.0, 1.6}))[0], 0.4);
  EXPECT_GT((*worth(claims, {Fix::kFloat, 9, 2.0, 4.0}))[0], 0.09);
  EXPECT_EQ(*worth(claims, {Fix::kFixed, 9, 1.0, 1.6}), claims);
  EXPECT_EQ((*worth(Vec3::Constant(3.0), {Fix::kFixed, 0, 0.0, 0.0}))[0], 3.0);
}

}  // namespace
}  // namespace rcs::wm
