// What a closed-loop drive records at alert limits, by the command that BG executes.

#include "tools/driving/alert_notes.h"

#include <gtest/gtest.h>

#include "lcmtypes/channels.h"
#include "rcs/base/protection_quantiles.h"
#include "rcs/node/bus/local_bus.h"

namespace rcs::driving {
namespace {

/// A vehicle at 2 m/s. Its limit is 20 m, and its commands have 4 m.
class Drive {
 public:
  void command(std::int8_t frame, double speed_mps = 2.0) {
    command_t m{};
    m.utime = utime_;
    m.kind = command_t::KIND_GOTO;
    m.frame = frame;
    m.alert_limit_horizontal_m = 4.0;
    m.n = 1;
    m.waypoint.resize(1);
    m.waypoint[0].speed_mps = speed_mps;
    deliver(channel::kBgCommand, m);
  }
  void drive(double seconds, double world_m, double map_m, double command_mps = 2.0) {
    for (int k = 0; k < 100.0 * seconds; ++k) {
      utime_ += 10'000;
      if (k % 10 == 0) {
        integrity_t integrity{};
        integrity.utime = utime_;
        integrity.validity = integrity_t::VALID_WORLD;
        integrity.protection_horizontal_m = world_m;
        integrity.protection_vertical_m = 1.0;
        deliver(channel::kWmIntegrity, integrity);
        nav_state_t nav{};
        nav.utime = utime_;
        nav.rolling_valid = 1;
        nav.q_world_vehicle[0] = nav.q_local_vehicle[0] = nav.q_rolling_vehicle[0] = 1.0;
        const double sigma_m = map_m / kHorizontalQuantile;
        nav.cov_rolling_pose[0][0] = nav.cov_rolling_pose[1][1] = sigma_m * sigma_m;
        deliver(channel::kWmNavState, nav);
      }
      if (k % 5 == 0) {
        drive_t m{};
        m.utime = utime_;
        m.speed_mps = command_mps;
        deliver(channel::kBgDrive, m);
      }
      truth_t m{};
      m.utime = utime_;
      m.v_world_mps[0] = 2.0;
      deliver(channel::kSimTruth, m);
    }
  }
  [[nodiscard]] const AlertOutcome& outcome() const { return notes_.outcome(); }

 private:
  template <class M>
  void deliver(std::string_view channel, const M& m) {
    std::vector<std::uint8_t> data(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(data.data(), 0, static_cast<int>(data.size()));
    bus_.deliver(channel, data.data(), data.size(), from_utime(m.utime));
  }

  std::int64_t utime_ = 1'000'000;
  LocalBus bus_;
  AlertNotes notes_{&bus_, command_t::FRAME_WORLD, vj::SpeedParams(), 2.0, 1.5};
};

TEST(AlertNotes, OnAWayBackTheLevelRelativeToTheMapCounts) {
  Drive drive;
  drive.command(command_t::FRAME_WORLD);
  drive.drive(5.0, 1.0, 100.0);
  drive.command(command_t::FRAME_ROLLING);
  drive.drive(10.0, 100.0, 1.0);
  EXPECT_EQ(drive.outcome().crossings, 0);
  EXPECT_EQ(drive.outcome().too_fast_s, 0.0);
  drive.drive(10.0, 1.0, 4.5);
  EXPECT_EQ(drive.outcome().crossings, 1);
  EXPECT_EQ(drive.outcome().late, 1);
}

TEST(AlertNotes, TheLimitIsThatOfTheCommand) {
  Drive drive;
  drive.drive(5.0, 5.0, 1.0);
  EXPECT_EQ(drive.outcome().crossings, 0) << "of a vehicle whose limit is 20 m";
  drive.command(command_t::FRAME_WORLD);
  drive.drive(5.0, 5.0, 1.0);
  EXPECT_EQ(drive.outcome().crossings, 1);
}

TEST(AlertNotes, TheSpeedIsThatOfTheCommand) {
  Drive drive;
  drive.command(command_t::FRAME_WORLD, 8.0);
  drive.drive(5.0, 3.0, 1.0);  // three quarters of the limit
  EXPECT_EQ(drive.outcome().too_fast_s, 0.0);
  drive.command(command_t::FRAME_WORLD, 2.0);
  drive.drive(5.0, 3.0, 1.0);
  EXPECT_GT(drive.outcome().too_fast_s, 3.0);
}

}  // namespace
}  // namespace rcs::driving
