#include "sim/vehicle/drive_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace rcs::sim {
namespace {

constexpr double kWheelbase_m = 2.4;
constexpr double kStep_s = 0.002;

DriveCommand go(double speed_mps, double curvature_1pm) {
  DriveCommand c;
  c.speed_mps = speed_mps;
  c.curvature_1pm = curvature_1pm;
  return c;
}

/// A model that is commanded 20 times a second, each command valid for 0.2 s.
class Driven {
 public:
  explicit Driven(const DriveParams& params) : model(params, kWheelbase_m, {}) {}

  void run(double length_s, const std::function<DriveCommand(double)>& driver,
           const std::function<void()>& look) {
    const int steps = static_cast<int>(std::lround(length_s / kStep_s));
    for (int k = 0; k < steps; ++k) {
      if (driver && step_ % 25 == 0) {
        DriveCommand c = driver(time_s());
        c.issued_s = time_s();
        c.valid_until_s = time_s() + 0.2;
        model.command(c, time_s());
      }
      ++step_;
      model.step_to(time_s());
      if (look) look();
    }
  }
  void run(double length_s, const DriveCommand& command) {
    run(length_s, [&](double) { return command; }, {});
  }
  [[nodiscard]] double time_s() const { return kStep_s * step_; }

  DriveModel model;

 private:
  int step_ = 0;
};

TEST(DriveModel, StandsUntilItIsCommanded) {
  Driven d({});
  d.run(3.0, {}, {});
  EXPECT_EQ(d.model.speed_mps(), 0.0);
  EXPECT_EQ(d.model.place().p_world, Vec2(0.0, 0.0));
  EXPECT_EQ(d.model.account().silences, 0);
}

TEST(DriveModel, ReachesTheCommandedSpeedAndCurvatureWithinItsLimits) {
  const DriveParams p;
  Driven d(p);
  double speed = 0.0;
  double curvature = 0.0;
  const auto look = [&] {
    EXPECT_LE(std::abs(d.model.speed_mps() - speed), p.acceleration_mps2 * kStep_s + 1e-12);
    EXPECT_LE(std::abs(d.model.curvature_1pm() - curvature), p.curvature_rate * kStep_s + 1e-12);
    speed = d.model.speed_mps();
    curvature = d.model.curvature_1pm();
  };
  d.run(
      4.0, [](double) { return go(6.0, 0.2); }, look);
  EXPECT_EQ(d.model.speed_mps(), 6.0);
  EXPECT_EQ(d.model.curvature_1pm(), 0.2);
}

TEST(DriveModel, ActsAfterTheActuatorsDelayAndNotBefore) {
  const DriveParams p;
  Driven d(p);
  d.run(p.delay_s - kStep_s, go(1.0, 0.0));
  EXPECT_EQ(d.model.speed_mps(), 0.0);
  d.run(0.5 * p.delay_s, go(1.0, 0.0));
  EXPECT_GT(d.model.speed_mps(), 0.0);
}

TEST(DriveModel, DrivesACircleOfTheCommandedCurvature) {
  for (const double rear_steer : {1.0, 0.5, 0.0}) {
    DriveParams p;
    p.rear_steer = rear_steer;
    Driven d(p);
    d.run(5.0, go(4.0, 0.1));
    const Vec2 begin = d.model.place().p_world;
    const double heading = d.model.place().heading_rad;
    // Half a turn: a diameter away.
    d.run(kPi / 0.1 / 4.0, go(4.0, 0.1));
    EXPECT_NEAR((d.model.place().p_world - begin).norm(), 20.0, 0.01) << rear_steer;
    EXPECT_NEAR(d.model.place().heading_rad - heading, kPi, 0.01);
  }
}

TEST(DriveModel, FrontSteeringSlipsBetweenTheAxlesAndNotAtTheRearOne) {
  DriveParams p;
  p.rear_steer = 0.0;
  Driven d(p);
  d.run(5.0, go(4.0, 0.15));
  const CoursePoint a = d.model.place();
  d.run(kStep_s, go(4.0, 0.15));
  const CoursePoint b = d.model.place();
  const auto at = [](const CoursePoint& c, double ahead_m) {
    return Vec2(c.p_world + ahead_m * Vec2(std::cos(c.heading_rad), std::sin(c.heading_rad)));
  };
  const double heading = 0.5 * (a.heading_rad + b.heading_rad);
  const Vec2 left(-std::sin(heading), std::cos(heading));
  EXPECT_NEAR(left.dot(at(b, -1.2) - at(a, -1.2)) / kStep_s, 0.0, 1e-5);
  EXPECT_NEAR(left.dot(at(b, 0.0) - at(a, 0.0)) / kStep_s, 4.0 * 0.15 * 1.2, 1e-3);
}

TEST(DriveModel, BrakesToAStopWhenTheCommandsEnd) {
  const DriveParams p;
  Driven d(p);
  d.run(6.0, go(8.0, 0.0));
  ASSERT_EQ(d.model.speed_mps(), 8.0);
  const double begin_m = d.model.place().p_world.x();
  d.run(4.0, {}, {});
  EXPECT_EQ(d.model.speed_mps(), 0.0);
  EXPECT_EQ(d.model.account().silences, 1);
  // The last command's validity (0.2 s), the delay, then v^2 / 2a.
  const double max_m = 8.0 * (0.2 + p.delay_s) + 0.5 * 64.0 / p.braking_mps2;
  EXPECT_LE(d.model.place().p_world.x() - begin_m, max_m + 0.02);
  const Vec2 rest = d.model.place().p_world;
  d.run(5.0, {}, {});
  EXPECT_EQ(d.model.place().p_world, rest);
  d.run(2.0, go(1.0, 0.0));  // and continues when commands arrive again
  EXPECT_EQ(d.model.speed_mps(), 1.0);
}

TEST(DriveModel, TheBrakeStopsTheVehicleSooner) {
  const DriveParams p;
  const auto way_m = [&](const DriveCommand& stop) {
    Driven d(p);
    d.run(6.0, go(8.0, 0.0));
    const double begin_m = d.model.place().p_world.x();
    d.run(4.0, stop);
    EXPECT_EQ(d.model.speed_mps(), 0.0);
    return d.model.place().p_world.x() - begin_m;
  };
  DriveCommand brake = go(8.0, 0.0);
  brake.brake = true;
  EXPECT_NEAR(way_m(go(0.0, 0.0)), 8.0 * p.delay_s + 32.0 / p.braking_mps2, 0.02);
  EXPECT_NEAR(way_m(brake), 8.0 * p.delay_s + 32.0 / p.hard_braking_mps2, 0.02);
}

// The contract of a vehicle interface (docs/user/own_vehicle.md).
TEST(DriveModel, StaysAtRestWhileTheNewestCommandHasAnEmergencyStop) {
  Driven d({});
  d.run(6.0, go(5.0, 0.0));
  ASSERT_NEAR(d.model.speed_mps(), 5.0, 0.01);
  DriveCommand stop = go(5.0, 0.0);  // a wrong speed and no brake
  stop.emergency_stop = true;
  d.run(0.05, stop);
  d.run(3.0, {}, {});  // and then the driver is silent
  EXPECT_EQ(d.model.speed_mps(), 0.0);
  const Vec2 rest = d.model.place().p_world;
  DriveCommand late = go(5.0, 0.0);  // issued before the stop
  late.issued_s = 5.99;
  late.valid_until_s = 7.9;
  d.model.command(late, d.time_s());
  d.run(1.0, {}, {});
  d.run(1.0, stop);
  EXPECT_EQ(d.model.place().p_world, rest);
  d.run(1.0, go(5.0, 0.0));
  EXPECT_GT(d.model.speed_mps(), 1.0) << "a later command without it";
}

TEST(DriveModel, AnEmergencyStopBrakesHardAlsoIfItHasExpired) {
  Driven d({});
  d.run(6.0, go(5.0, 0.0));
  DriveCommand stop;
  stop.emergency_stop = true;
  stop.issued_s = d.time_s() - 0.001;
  stop.valid_until_s = stop.issued_s + 0.0005;
  d.model.command(stop, d.time_s());
  d.run(1.2, {}, {});
  EXPECT_EQ(d.model.speed_mps(), 0.0) << "5 m/s at 5 m/s^2, after the delay";
}

TEST(DriveModel, GoesBackwardThroughRest) {
  const DriveParams p;
  Driven d(p);
  d.run(3.0, go(3.0, 0.0));
  double before = d.model.speed_mps();
  d.run(
      4.0, [](double) { return go(-2.0, 0.0); },
      [&] {
        const double limit = before > 0.0 ? p.braking_mps2 : p.acceleration_mps2;
        EXPECT_LE(before - d.model.speed_mps(), limit * kStep_s + 1e-12);
        before = d.model.speed_mps();
      });
  EXPECT_EQ(d.model.speed_mps(), -2.0);
}

TEST(DriveModel, AcceleratesNoFasterThanCommanded) {
  Driven d({});
  DriveCommand gently = go(5.0, 0.0);
  gently.accel_limit_mps2 = 0.5;
  d.run(1.06, gently);
  EXPECT_NEAR(d.model.speed_mps(), 0.5, 0.01);
}

TEST(DriveModel, RejectsInvalidCommands) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const auto with = [](const std::function<void(DriveCommand*)>& change) {
    DriveCommand c = go(1.0, 0.0);
    c.issued_s = 10.0;
    c.valid_until_s = 10.2;
    change(&c);
    return c;
  };
  const DriveCommand bad[] = {
      with([&](DriveCommand* c) { c->speed_mps = nan; }),
      with([&](DriveCommand* c) { c->curvature_1pm = nan; }),
      with([&](DriveCommand* c) { c->accel_limit_mps2 = nan; }),
      with([&](DriveCommand* c) { c->issued_s = nan; }),
      with([&](DriveCommand* c) { c->valid_until_s = nan; }),
      with([&](DriveCommand* c) { c->speed_mps = inf; }),
      with([&](DriveCommand* c) { c->speed_mps = 15.1; }),
      with([&](DriveCommand* c) { c->speed_mps = -2.1; }),
      with([&](DriveCommand* c) { c->curvature_1pm = -0.21; }),
      with([&](DriveCommand* c) { c->accel_limit_mps2 = -1.0; }),
      with([&](DriveCommand* c) { c->issued_s = 10.1; }),       // in the future
      with([&](DriveCommand* c) { c->valid_until_s = 12.1; }),  // for too long
      with([&](DriveCommand* c) { c->valid_until_s = 10.0; }),  // for no time
      with([&](DriveCommand* c) { c->valid_until_s = -1e300; }),
  };
  DriveModel model({}, kWheelbase_m, {});
  model.step_to(10.0);
  std::int64_t refused = 0;
  for (const DriveCommand& c : bad) {
    model.command(c, 10.0);
    EXPECT_EQ(model.account().implausible, ++refused);
  }
  for (int k = 1; k < 500; ++k) model.step_to(10.0 + k * kStep_s);
  EXPECT_EQ(model.speed_mps(), 0.0);

  DriveCommand good = with([](DriveCommand*) {});
  model.command(good, 10.25);
  EXPECT_EQ(model.account().expired, 1);
  model.command(good, 10.0);
  model.command(good, 10.05);  // repeated
  good.issued_s = 9.9;         // stepping back
  model.command(good, 10.05);
  EXPECT_EQ(model.account().taken, 1);
  EXPECT_EQ(model.account().stale, 2);
  EXPECT_EQ(model.account().implausible, refused);
}

TEST(DriveModel, DependsOnlyOnTheCommandsAndTheirArrivals) {
  // The motion does not depend on the delay with which a command is processed.
  DriveModel at_once({}, kWheelbase_m, {});
  DriveModel ahead({}, kWheelbase_m, {});
  for (int k = 0; k <= 20; ++k) {
    DriveCommand c = go(0.1 * k, 0.01 * k);
    c.issued_s = 0.05 * k;
    c.valid_until_s = c.issued_s + 0.2;
    ahead.command(c, c.issued_s);
  }
  for (int k = 0; k < 500; ++k) {
    if (k % 25 == 0) {
      const int n = k / 25;
      DriveCommand c = go(0.1 * n, 0.01 * n);
      c.issued_s = 0.05 * n;
      c.valid_until_s = c.issued_s + 0.2;
      at_once.command(c, c.issued_s);
    }
    at_once.step_to(kStep_s * (k + 1));
    ahead.step_to(kStep_s * (k + 1));
    ASSERT_EQ(at_once.place().p_world, ahead.place().p_world);
  }
  EXPECT_GT(at_once.speed_mps(), 0.5);
}

}  // namespace
}  // namespace rcs::sim
