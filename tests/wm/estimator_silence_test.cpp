// Sources that fall silent and return: short motions are not extrapolated, correct sources are not
// excluded afterwards, and the clocks may step during the silence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "modules/wm/alignment.h"
#include "modules/wm/integrity.h"
#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

struct Fault {
  std::function<bool(double t_s)> ins_silent = [](double) { return false; };
  std::function<bool(double t_s)> others_silent = [](double) { return false; };
  std::function<double(double t_s)> clock_s = [](double) { return 0.0; };  ///< of all
  std::function<double(double t_s)> ins_clock_s = [](double) {
    return 0.0;
  };  ///< additional, of the INS
};

struct Seen {
  double worst_m = 0.0;             ///< horizontal error
  double worst_turn_rad = 0.0;      ///< of the attitude, from one input to the next
  double worst_tilt_rad = 0.0;      ///< error of roll and pitch
  double end_local_tilt_rad = 0.0;  ///< the same in frame local
  double end_m = 0.0;
  double end_s = 0.0;  ///< of the last sample with a world pose
  int findings = 0;
  SourceStatus gps = SourceStatus::kNone;  ///< at the end
  int clock_steps = 0;
};

Seen drive(const Fault& fault, double brake_from_s = 1e9) {
  Experiment experiment;
  experiment.drive.length_s = 60.0;
  experiment.drive.brake_from_s = brake_from_s;
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  Seen seen;
  Quat before = Quat::Identity();
  Quat truth_before = Quat::Identity();
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double t = seconds(truth[i].stamp - truth[0].stamp);
    const Stamp arrival = truth[i].stamp + from_seconds(1000.0);
    const Duration shift = from_seconds(fault.clock_s(t));
    ImuSample imu = sensors.imu(i);
    imu.stamp += shift + from_seconds(fault.ins_clock_s(t));
    const Stamp stamp = truth[i].stamp + shift;
    const RollingMatch match = sensors.scan(i);
    const GeodeticFix fix = sensors.gps(i);
    const OdometrySample wheels = sensors.odometry(i);
    if (!fault.ins_silent(t)) estimator.add(imu, arrival);
    if (!fault.others_silent(t)) {
      if (i % 5 == 0) estimator.add(stamp, wheels, arrival);
      if (i % 10 == 0) estimator.add(stamp, match, arrival);
      if (i % 20 == 0) estimator.add(stamp, fix, arrival);
    }
    estimator.watch_clocks(arrival);
    estimator.fuse();
    estimator.clear_innovations();
    if (!estimator.started() || !estimator.state().bookkeeping.georeferenced) continue;
    const NavState& x = estimator.state().belief.x;
    if (t > 20.0 && before.coeffs() != Quat::Identity().coeffs()) {
      const Quat turned = before.conjugate() * x.T_world_vehicle.q;
      const Quat truly = truth_before.conjugate() * truth[i].T_world_vehicle.q;
      seen.worst_turn_rad =
          std::max(seen.worst_turn_rad, log_so3(truly.conjugate() * turned).norm());
    }
    before = x.T_world_vehicle.q;
    truth_before = truth[i].T_world_vehicle.q;
    // Only a belief of this instant can be compared with it.
    if (t < 20.0 || abs(x.stamp - stamp) > from_milliseconds(20.0)) continue;
    seen.end_s = t;
    seen.end_m = (x.T_world_vehicle.p - truth[i].T_world_vehicle.p).head<2>().norm();
    seen.worst_m = std::max(seen.worst_m, seen.end_m);
    const Vec3 up = x.T_world_vehicle.q.conjugate() * Vec3::UnitZ();
    const Vec3 true_up = truth[i].T_world_vehicle.q.conjugate() * Vec3::UnitZ();
    seen.worst_tilt_rad = std::max(seen.worst_tilt_rad, up.cross(true_up).norm());
    const Vec3 local_up = estimator.T_local_vehicle().q.conjugate() * Vec3::UnitZ();
    seen.end_local_tilt_rad = local_up.cross(true_up).norm();
  }
  seen.findings = estimator.fault_detection().findings();
  seen.gps = estimator.fault_detection().gps(estimator.state(), experiment.params.modes);
  seen.clock_steps = estimator.clock_steps();
  return seen;
}

auto between(double from_s, double to_s) {
  return [=](double t) { return t > from_s && t < to_s; };
}

TEST(EstimatorSilence, OfTheInsIsBridgedByTheOtherSources) {
  for (const double length_s : {0.1, 0.3, 1.0, 3.0, 10.0}) {
    Fault fault;
    fault.ins_silent = between(30.0, 30.0 + length_s);
    const Seen seen = drive(fault);
    EXPECT_LT(seen.worst_m, 2.5) << length_s;
    EXPECT_LT(seen.worst_tilt_rad, 0.2) << length_s;
    EXPECT_EQ(seen.findings, 0) << length_s;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << length_s;
  }
}

TEST(EstimatorSilence, OfAllSourcesEndsWithTheFirstFixes) {
  for (const double length_s : {0.1, 0.3, 1.0, 3.0}) {
    Fault fault;
    fault.ins_silent = fault.others_silent = between(30.0, 30.0 + length_s);
    const Seen seen = drive(fault);
    EXPECT_LT(seen.end_m, 1.5) << length_s;
    EXPECT_LT(seen.worst_turn_rad, 0.35 + 0.35 * length_s) << length_s;
    EXPECT_LT(seen.end_local_tilt_rad, 0.02) << length_s << " " << seen.worst_tilt_rad;
    EXPECT_EQ(seen.findings, 0) << length_s;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << length_s;
  }
}

/// The vehicle stands all the time: its place is that in the rolling map, without any motion.
TEST(EstimatorSilence, OfAllSourcesAtRestEndsWithTheFirstMatch) {
  for (const double length_s : {1.8, 3.0, 4.5, 8.0}) {
    Fault fault;
    fault.ins_silent = fault.others_silent = between(45.0, 45.0 + length_s);
    const Seen seen = drive(fault, 35.0);
    EXPECT_GT(seen.end_s, 59.5) << length_s;
    EXPECT_LT(seen.end_m, 1.0) << length_s;
    EXPECT_EQ(seen.findings, 0) << length_s;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << length_s;
  }
}

// The silence begins for the INS long before it does for the others.
TEST(EstimatorSilence, OfAllSourcesWhileTheInsIsSilentEndsWithTheFirstFixes) {
  for (const double from_s : {30.0, 34.0, 37.0}) {
    Fault fault;
    fault.ins_silent = [=](double t) { return t > from_s && t < from_s + 8.0; };
    fault.others_silent = [=](double t) { return t > from_s + 3.5 && t < from_s + 8.0; };
    const Seen seen = drive(fault);
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << from_s;
    EXPECT_LT(seen.end_m, 1.5) << from_s;
    EXPECT_EQ(seen.findings, 0) << from_s;
  }
}

TEST(EstimatorSilence, ACommonClockStepMovesNothing) {
  for (const double step_s : {0.05, 0.2, 3.0, -0.2, -3.0}) {
    for (const double until_s : {40.003, 1e9}) {
      Fault fault;
      fault.clock_s = [=](double t) { return t > 30.003 && t < until_s ? step_s : 0.0; };
      const Seen seen = drive(fault);
      EXPECT_LT(seen.worst_m, 1.5) << step_s << " until " << until_s;
      EXPECT_LT(seen.worst_turn_rad, 0.05) << step_s << " until " << until_s;
      EXPECT_EQ(seen.clock_steps, until_s < 60.0 ? 2 : 1) << step_s;
      EXPECT_EQ(seen.gps, SourceStatus::kFully) << step_s;
    }
  }
}

TEST(EstimatorSilence, AClockStepOfTheInsMovesNothing) {
  for (const double step_s : {0.05, 0.2, 3.0, -0.2}) {
    for (const double until_s : {40.003, 1e9}) {
      Fault fault;
      fault.ins_clock_s = [=](double t) { return t > 30.003 && t < until_s ? step_s : 0.0; };
      const Seen seen = drive(fault);
      EXPECT_LT(seen.worst_m, 1.5) << step_s << " until " << until_s;
      EXPECT_LT(seen.worst_turn_rad, 0.05) << step_s << " until " << until_s;
      EXPECT_EQ(seen.clock_steps, 0) << step_s;
    }
  }
}

/// Tilt in frame world and in frame local.
struct Tilt {
  double world_rad;
  double local_rad;
};

/// After 0.8 s of a level INS that follows a gap, with a pitch that is wrong by 0.3 rad.
Tilt tilt_after_a_gap(double sigma_rad, double gap_s) {
  const WmParams params;
  const Model model(params);
  const Stamp begin{from_seconds(100.0)};
  FilterState s;
  s.belief = initial_belief(params, begin);
  s.belief.x.T_world_vehicle.q = exp_so3(Vec3(0.0, 0.3, 0.0));
  s.belief.x.inertial = true;
  s.bookkeeping.T_local_vehicle = s.belief.x.T_world_vehicle;
  s.belief.P.diagonal().segment<3>(kAttitude).setConstant(sigma_rad * sigma_rad);
  s.bookkeeping.ins_stamp = begin;
  s.bookkeeping.odometry_mps = 6.0;  // it moves: no zero-velocity update
  const Duration period = from_milliseconds(10.0);
  const Stamp from = begin + from_seconds(gap_s);
  for (Stamp t = from; t < from + from_seconds(0.8); t += period) {
    const ImuSample imu{t, period, Vec3::Zero(),
                        Vec3(0.0, 0.0, model.earth.gravity * seconds(period))};
    Innovations unread;
    advance(model, t, &imu, &s, &unread);
  }
  const auto tilt = [](const Quat& q) { return std::acos((q * Vec3::UnitZ()).z()); };
  return {tilt(s.belief.x.T_world_vehicle.q), tilt(s.bookkeeping.T_local_vehicle.q)};
}

TEST(EstimatorSilence, AfterAGapTheSpecificForceLevelsAnUncertainVehicle) {
  EXPECT_LT(tilt_after_a_gap(0.3, 3.0).world_rad, 0.05);
  // A short gap changes nothing: an acceleration is no tilt.
  EXPECT_GT(tilt_after_a_gap(0.01, 0.3).world_rad, 0.25);
}

// A process that was stopped finds the messages of the meantime in its queues: of the INS the
// newest or all, of slower sensors all. Those of before the first INS sample, or of before the
// fusion of a part of the INS samples, are late, and no sign of clocks that have stepped. SP has
// tracked the vehicle meanwhile.
TEST(EstimatorSilence, OfThisProcessIsNoClockStep) {
  for (const auto& [stopped_s, kept] : {std::pair<double, std::size_t>{2.5, 64},
                                        {3.0, 64},
                                        {4.5, 64},
                                        {2.6, 1024},
                                        {3.0, 1024},
                                        {3.7, 1024},
                                        {4.5, 1024}}) {
    const double length_s = stopped_s;  // bindings cannot be captured
    const std::size_t queue = kept;
    Experiment experiment;
    experiment.drive.length_s = 40.0;
    Rig rig(experiment);
    auto& [truth, sensors, estimator] = rig;
    std::vector<std::pair<Stamp, ImuSample>> imus;
    std::vector<std::pair<Stamp, OdometrySample>> wheels;
    std::vector<std::pair<Stamp, RollingMatch>> matches;
    std::vector<std::pair<Stamp, GeodeticFix>> fixes;
    double worst_m = 0.0;
    double worst_tilt_rad = 0.0;
    std::int64_t epoch = -1;
    for (std::size_t i = 1; i < truth.size(); ++i) {
      const double t = seconds(truth[i].stamp - truth[0].stamp);
      const Stamp stamp = truth[i].stamp;
      imus.emplace_back(stamp, sensors.imu(i));
      const RollingMatch match = sensors.scan(i);
      const GeodeticFix fix = sensors.gps(i);
      const OdometrySample odometry = sensors.odometry(i);
      if (i % 5 == 0) wheels.emplace_back(stamp, odometry);
      if (i % 10 == 0) matches.emplace_back(stamp, match);
      if (i % 20 == 0) fixes.emplace_back(stamp, fix);
      if (t > 30.0 && t < 30.0 + length_s) continue;
      // The thread that receives is stopped with the process, or not.
      const auto arrival = [&](Stamp at) { return queue == 64 ? stamp : at; };
      std::size_t taken = 0;
      for (std::size_t k = imus.size() - std::min(imus.size(), queue); k < imus.size(); ++k) {
        estimator.add(imus[k].second, arrival(imus[k].first));
        if (++taken % 256 == 0) estimator.fuse();  // as WmNode does
      }
      for (const auto& [at, sample] : wheels) estimator.add(at, sample, arrival(at));
      for (const auto& [at, sample] : fixes) estimator.add(at, sample, arrival(at));
      for (const auto& [at, sample] : matches) estimator.add(at, sample, arrival(at));
      imus.clear();
      wheels.clear();
      matches.clear();
      fixes.clear();
      estimator.watch_clocks(stamp);
      estimator.fuse();
      estimator.clear_innovations();
      if (t < 30.0) epoch = estimator.state().belief.x.map_epoch;
      if (t < 30.5 + length_s) continue;
      const Pose& here = estimator.state().belief.x.T_world_vehicle;
      worst_m = std::max(worst_m, (here.p - truth[i].T_world_vehicle.p).head<2>().norm());
      const Vec3 up = estimator.T_local_vehicle().q.conjugate() * Vec3::UnitZ();
      const Vec3 true_up = truth[i].T_world_vehicle.q.conjugate() * Vec3::UnitZ();
      worst_tilt_rad = std::max(worst_tilt_rad, up.cross(true_up).norm());
    }
    EXPECT_EQ(estimator.clock_steps(), 0) << length_s;
    EXPECT_EQ(estimator.state().belief.x.map_epoch, epoch) << length_s;
    EXPECT_LT(worst_m, 1.0) << length_s;
    EXPECT_LT(worst_tilt_rad, 0.02) << length_s;
  }
}

}  // namespace
}  // namespace rcs::wm
