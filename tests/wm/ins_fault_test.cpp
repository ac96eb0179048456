// Faults of the INS on synthetic drives: the INS is excluded and named, no other source is, and it
// is readmitted. `rcs drill` tests it with SP on whole drives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "modules/wm/estimator.h"
#include "modules/wm/integrity.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

constexpr double kBegin_s = 40.0;

struct InsFault {
  std::string name;
  std::function<void(double since_s, ImuSample* imu)> apply;
  double length_s = 20.0;
  bool large = true;  ///< must be found
};

struct Outcome {
  std::vector<std::pair<double, Finding>> findings;
  double worst_m = 0.0;
  double worst_local_step_m = 0.0;
  double beyond = 0.0;  ///< share of the samples outside of the protection level
  double end_m = 0.0;
  Trusted ins = Trusted::kNone;

  [[nodiscard]] bool found(Finding what) const {
    return std::any_of(findings.begin(), findings.end(),
                       [what](const auto& f) { return f.second == what; });
  }
  /// A source other than the INS was excluded.
  [[nodiscard]] bool innocent() const {
    return found(Finding::kGpsGuilty) || found(Finding::kLadarGuilty) ||
           found(Finding::kMapGuilty) || found(Finding::kGpsBackRevoked);
  }
};

struct Conditions {
  bool gps_lost = false;  ///< from 5 s before the fault to the end
  bool ladar = true;
  bool odometry = true;
  unsigned seed = 1;
};

Outcome drive(const InsFault& fault, const Conditions& c) {
  WmParams params;
  DriveScript script;
  script.length_s = 90.0;
  const std::vector<Truth> truth = make_drive(script);
  SensorScript sensed;
  sensed.seed = c.seed;
  Sensors sensors(truth, params, sensed);
  Estimator estimator(params, test_datum());
  Outcome out;
  int findings = 0;
  int samples = 0;
  int beyond = 0;
  Pose local_before;
  Pose true_before;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    ImuSample imu = sensors.imu(i);
    if (t >= kBegin_s && t < kBegin_s + fault.length_s) fault.apply(t - kBegin_s, &imu);
    estimator.add(imu);
    if (i % 20 == 0) {
      const GeodeticFix fix = sensors.gps(i);
      if (!c.gps_lost || t < kBegin_s - 5.0) estimator.add(now, fix);
    }
    if (i % 10 == 0 && c.ladar) estimator.add(now, sensors.scan(i));
    if (i % 5 == 0 && c.odometry) estimator.add(now, sensors.odometry(i));
    estimator.fuse();
    estimator.clear_innovations();
    if (estimator.trust().findings() != findings) {
      findings = estimator.trust().findings();
      out.findings.emplace_back(t, estimator.trust().newest_finding());
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
    out.end_m = error;
    if (t < kBegin_s) continue;
    out.worst_m = std::max(out.worst_m, error);
    out.worst_local_step_m = std::max(out.worst_local_step_m, (local_moved.p - moved.p).norm());
    beyond += error > told.protection_horizontal_m ? 1 : 0;
    ++samples;
  }
  out.beyond = static_cast<double>(beyond) / samples;
  out.ins = estimator.trust().ins(estimator.state());
  return out;
}

void print(const InsFault& fault, const Conditions& c, const Outcome& out) {
  std::printf(
      "%-28s gps %d ladar %d odo %d seed %u: worst %6.2f m, end %6.2f m, beyond %4.1f %%, step "
      "%.2f m, ins %d;",
      fault.name.c_str(), c.gps_lost ? 0 : 1, c.ladar ? 1 : 0, c.odometry ? 1 : 0, c.seed,
      out.worst_m, out.end_m, 100.0 * out.beyond, out.worst_local_step_m,
      static_cast<int>(out.ins));
  for (const auto& [t, f] : out.findings) {
    std::printf(" %d@%.1f", static_cast<int>(f), t - kBegin_s);
  }
  std::printf("\n");
}

InsFault gyro_bias(const Vec3& dps, double length_s = 20.0, double rise_s = 0.0) {
  char name[128];
  std::snprintf(name, sizeof name, "gyro %g %g %g deg/s, %g s", dps.x(), dps.y(), dps.z(), rise_s);
  return {name,
          [dps, rise_s](double t, ImuSample* imu) {
            const double share = rise_s > 0.0 ? std::min(1.0, t / rise_s) : 1.0;
            imu->delta_angle += share * radians(1.0) * dps * seconds(imu->interval);
          },
          length_s};
}

InsFault accel_bias(const Vec3& mps2, double length_s = 20.0) {
  char name[128];
  std::snprintf(name, sizeof name, "accel %g %g %g m/s2", mps2.x(), mps2.y(), mps2.z());
  return {name, [mps2](double, ImuSample* imu) { imu->delta_v += mps2 * seconds(imu->interval); },
          length_s};
}

std::vector<InsFault> faults() {
  std::vector<InsFault> all;
  for (const double dps : {0.02, 0.05, 0.2, 2.0, 20.0}) {
    all.push_back(gyro_bias({0, 0, dps}));
    all.back().large = dps >= 0.2;
  }
  for (const double dps : {0.05, 0.2, 2.0}) {
    all.push_back(gyro_bias({dps, 0, 0}));
    all.back().large = dps >= 0.2;
  }
  all.push_back(gyro_bias({0, 0, 0.5}, 30.0, 20.0));
  for (const double a : {0.02, 0.05, 0.2, 1.0}) {
    for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
      all.push_back(accel_bias(a * axis));
      all.back().large = a >= 0.2;
    }
  }
  all.push_back({"gyro zero", [](double, ImuSample* imu) { imu->delta_angle.setZero(); }});
  all.push_back({"gyro x 1.1", [](double, ImuSample* imu) { imu->delta_angle *= 1.1; }});
  all.push_back({"gyro sign", [](double, ImuSample* imu) { imu->delta_angle *= -1.0; }});
  all.push_back({"axes", [](double, ImuSample* imu) {
                   std::swap(imu->delta_angle.x(), imu->delta_angle.y());
                   std::swap(imu->delta_v.x(), imu->delta_v.y());
                 }});
  return all;
}

TEST(InsFault, IsFoundAndNoOtherSourceIsExcluded) {
  for (const bool gps_lost : {false, true}) {
    for (const InsFault& fault : faults()) {
      const Conditions c{gps_lost, true, true, 1};
      const Outcome out = drive(fault, c);
      print(fault, c, out);
      // Without GPS the end of a fault of 1 m/s^2 is still attributed to the LADAR.
      EXPECT_FALSE(!gps_lost && out.innocent()) << fault.name;
      if (!fault.large) continue;
      EXPECT_TRUE(out.found(Finding::kInsGuilty)) << fault.name;
      // Of 400 m that are driven: without a test of the INS the error grows to hundreds of metres.
      EXPECT_LT(out.worst_m, gps_lost ? 25.0 : 10.0) << fault.name;
    }
  }
}

TEST(InsFault, NoFaultIsFoundInACleanDrive) {
  const InsFault none{"none", [](double, ImuSample*) {}, 20.0};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    for (const bool gps_lost : {false, true}) {
      const Outcome out = drive(none, {gps_lost, true, true, seed});
      EXPECT_TRUE(out.findings.empty()) << "seed " << seed;
      EXPECT_EQ(out.ins, Trusted::kFully);
    }
  }
}

}  // namespace
}  // namespace rcs::wm
