#include "tests/wm/fault_drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "modules/wm/integrity.h"

namespace rcs::wm {
namespace {

std::string text(const Vec3& v) {
  char out[96];
  std::snprintf(out, sizeof out, "(%g %g %g)", v.x(), v.y(), v.z());
  return out;
}

}  // namespace

InsFault gyro_bias(const Vec3& dps) {
  return {
      "gyro bias " + text(dps) + " deg/s",
      [dps](ImuSample* imu) { imu->delta_angle += radians(1.0) * dps * seconds(imu->interval); },
      dps.norm() >= 0.2};
}

InsFault accel_bias(const Vec3& mps2) {
  return {"accelerometer bias " + text(mps2) + " m/s^2",
          [mps2](ImuSample* imu) { imu->delta_v += mps2 * seconds(imu->interval); },
          mps2.norm() >= 0.2};
}

InsFault exchanged_axes() {
  return {"axes x and y exchanged", [](ImuSample* imu) {
            std::swap(imu->delta_angle.x(), imu->delta_angle.y());
            std::swap(imu->delta_v.x(), imu->delta_v.y());
          }};
}

Seen drive(double length_s, const Disturbance& d, unsigned seed, double from_s, double edge_rad) {
  WmParams params;
  DriveScript script;
  script.edge_rad = edge_rad;
  script.length_s = length_s;
  const std::vector<Truth> truth = make_drive(script);
  SensorScript sensed;
  sensed.seed = seed;
  Sensors sensors(truth, params, sensed);
  Estimator estimator(params, test_datum());
  const LocalFrame frame(test_datum());
  std::mt19937 random(seed);
  std::normal_distribution<double> unit;
  Seen seen;
  int findings = 0;
  Pose local_before;
  Pose true_before;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    ImuSample imu = sensors.imu(i);
    d.ins(t, &imu);
    if (d.has_ins(t)) estimator.add(imu);
    if (i % 20 == 0) {
      GeodeticFix fix = sensors.gps(i);
      const Quat turned(Eigen::AngleAxisd(d.turned_rad(t), Vec3::UnitZ()));
      const std::size_t at_40s = std::min(truth.size() - 1, std::size_t{4000});
      const Vec3 center = truth[at_40s].T_world_vehicle.p;
      const Vec3 antenna = center + turned * (frame.to_world(fix.antenna) - center);
      fix.antenna = frame.to_geodetic(antenna + d.fix_off(t));
      fix.fix.has_velocity = d.sigma_v_mps > 0.0;
      if (fix.fix.has_velocity) {
        const Truth& x = truth[i];
        fix.fix.v_world =
            x.v_world + x.T_world_vehicle.q * x.rate_vehicle.cross(params.gps.lever_m);
        fix.fix.v_world = turned * fix.fix.v_world;
        for (double& v : fix.fix.v_world) v += d.sigma_v_mps * unit(random);
        fix.fix.sigma_v_mps.setConstant(d.sigma_v_mps);
      }
      fix.fix.v_world += d.velocity_off(t);
      if (d.has_fix(t)) estimator.add(now, fix);
    }
    if (i % 10 == 0) {
      RollingMatch match = sensors.scan(i);
      match.T_rolling_vehicle.p += d.match_off(t);
      d.match(t, &match);
      if (d.has_match(t)) estimator.add(now, match);
    }
    if (d.map_off && i % 10 == 0) estimator.add(now, sensors.prior(i, d.map_off(t)));
    if (i % 5 == 0) {
      OdometrySample wheels = sensors.odometry(i);
      d.wheels(t, &wheels);
      estimator.add(now, wheels);
    }
    estimator.fuse();
    estimator.clear_innovations();
    if (estimator.fault_detection().findings() != findings) {
      findings = estimator.fault_detection().findings();
      seen.findings.emplace_back(t, estimator.fault_detection().newest_finding());
      const Finding newest = seen.findings.back().second;
      const double ratio = estimator.fault_detection().finding_ratio();
      std::printf("%.1f s: finding %d, test ratio %.2f, moved by %.2f m\n", t,
                  static_cast<int>(newest), ratio, estimator.fault_detection().finding_moved_m());
      if (newest == Finding::kGpsFaulty || newest == Finding::kLadarFaulty ||
          newest == Finding::kMapFaulty) {
        EXPECT_GT(ratio, 1.0);  // what an event reports as the cause
        EXPECT_GT(estimator.fault_detection().finding_moved_m(), 0.0);
      }
    }
    if (i % 10 != 0 || !estimator.started() || !estimator.state().bookkeeping.georeferenced) {
      continue;
    }
    const FilterState& s = estimator.state();
    const Integrity told = integrity(s, estimator.fault_detection(), Duration::zero(), params);
    const Vec3 off_m = s.belief.x.T_world_vehicle.p - truth[i].T_world_vehicle.p;
    const double error = off_m.head<2>().norm();
    const Pose local_moved = local_before.inverse() * estimator.T_local_vehicle();
    const Pose moved = true_before.inverse() * truth[i].T_world_vehicle;
    local_before = estimator.T_local_vehicle();
    true_before = truth[i].T_world_vehicle;
    seen.end_m = error;
    seen.end_up_m = off_m.z();
    seen.forces_excluded = seen.forces_excluded || s.bookkeeping.excluded.force;
    if (t < from_s) continue;
    if ((told.alerts & kAlertGps) != 0 && seen.first_alert_s < 0.0) seen.first_alert_s = t;
    if ((told.alerts & kAlertLadar) != 0 && seen.first_ladar_alert_s < 0.0) {
      seen.first_ladar_alert_s = t;
    }
    if ((told.alerts & kAlertIns) != 0 && seen.first_ins_alert_s < 0.0) seen.first_ins_alert_s = t;
    seen.worst_m = std::max(seen.worst_m, error);
    seen.worst_local_step_m = std::max(seen.worst_local_step_m, (local_moved.p - moved.p).norm());
    seen.beyond_protection += error > told.protection_horizontal_m ? 1 : 0;
    seen.above_protection += std::abs(off_m.z()) > told.protection_vertical_m ? 1 : 0;
    seen.lowest_level_m = std::min(seen.lowest_level_m, told.protection_horizontal_m);
    seen.highest_level_up_m = std::max(seen.highest_level_up_m, told.protection_vertical_m);
    ++seen.samples;
  }
  seen.gps = estimator.fault_detection().gps(estimator.state(), params.modes);
  seen.ladar = estimator.fault_detection().ladar(estimator.state(), params.modes);
  seen.ins = estimator.fault_detection().ins(estimator.state());
  return seen;
}

}  // namespace rcs::wm
