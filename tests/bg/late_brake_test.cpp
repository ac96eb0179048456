// A person steps in front of a vehicle that is stopping: its gentle deceleration is not enough.

#include <gtest/gtest.h>

#include "tests/bg/bg_life.h"

namespace rcs::bg::test {
namespace {

class LateBrake : public ::testing::Test {
 protected:
  LateBrake() { life_.moves = true; }

  void cycle() {
    map_patch_t m{};
    m.utime = to_utime(now_);
    m.cell_m = 0.4;
    m.first_i = static_cast<std::int32_t>(std::floor(life_.x_m / m.cell_m)) - kSide / 2;
    m.first_j = -kSide / 2;
    m.width = m.height = kSide;
    m.n = kSide * kSide;
    m.height_cm.assign(kCells, 0);
    m.step_cm.assign(kCells, 0);
    m.slope_deg.assign(kCells, 0);
    m.roughness_cm.assign(kCells, 0);
    m.flags.assign(kCells, 0);
    for (int j = -2; j < 2 && person_m_ > 0.0; ++j) {
      const int i = static_cast<int>(std::floor(person_m_ / m.cell_m)) - m.first_i;
      if (i < 0 || i >= kSide) continue;
      const int k = (j - m.first_j) * kSide + i;
      m.flags[static_cast<std::size_t>(k)] = map_patch_t::FLAG_OBSTACLE;
      m.step_cm[static_cast<std::size_t>(k)] = 170;
    }
    patches_.publish(&m);
    life_.cycle();
  }
  void drive() {
    cycle();
    for (int k = 0; k < 200 && life_.speed_mps < 4.0; ++k) {
      if (k % 45 == 0) life_.send(kGoto);
      cycle();
    }
    ASSERT_GE(life_.speed_mps, 4.0) << life_.status.state;
  }
  /// From the middle of the vehicle, from the next cycle on.
  void person_at(double ahead_m) { person_m_ = life_.x_m + ahead_m; }
  /// Until the vehicle is at rest. @return it was commanded to brake
  bool brakes_until_rest() {
    bool braked = false;
    for (int k = 0; k < 100 && life_.speed_mps > 0.05; ++k) {
      cycle();
      braked = braked || life_.brakes();
    }
    EXPECT_LE(life_.speed_mps, 0.05);
    return braked;
  }

  static constexpr int kSide = 100;
  static constexpr std::size_t kCells = std::size_t{kSide} * kSide;
  Stamp now_{from_seconds(100.0)};
  double person_m_ = 0.0;  // 0: nobody
  Life life_{"", StopLatch(), &now_};
  Outbox<map_patch_t> patches_{&life_.watched, channel::kWmMapPatch};
};

TEST_F(LateBrake, InHaltTheVehicleBrakesForAPersonWhoStepsInFrontOfIt) {
  drive();
  life_.send(command_t::KIND_HALT);
  cycle();
  ASSERT_EQ(life_.status.state, "HALT");
  EXPECT_FALSE(life_.brakes());
  person_at(5.0);
  EXPECT_TRUE(brakes_until_rest());
  EXPECT_TRUE(life_.has_event("obstacle.late"));
}

TEST_F(LateBrake, WithAnExpiredCommandItBrakesForAPersonOnItsPath) {
  drive();
  for (int k = 0; k < 100 && life_.status.state != "COMMAND_EXPIRED"; ++k) cycle();
  ASSERT_EQ(life_.status.state, "COMMAND_EXPIRED");
  ASSERT_GT(life_.speed_mps, 3.0);
  person_at(4.2);
  EXPECT_TRUE(brakes_until_rest());
}

TEST_F(LateBrake, WithoutAnObstacleTheVehicleStopsGently) {
  drive();
  life_.send(command_t::KIND_HALT);
  EXPECT_FALSE(brakes_until_rest());
}

TEST_F(LateBrake, BeforeAPersonWhoIsFarEnoughItStopsGently) {
  drive();
  life_.send(command_t::KIND_HALT);
  person_at(25.0);
  EXPECT_FALSE(brakes_until_rest());
}

}  // namespace
}  // namespace rcs::bg::test
