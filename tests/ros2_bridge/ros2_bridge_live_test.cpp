// On a private bus (with_bus.sh): the bridge and SP as processes, and a program that uses the IDL
// of ROS 2 and nothing else, over loopback in a DDS domain of their own.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "rcs/base/check.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/node.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/gateway/program.h"
#include "tests/support/fresh_folder.h"

namespace rcs::ros2_bridge {
namespace {

namespace fs = std::filesystem;
using test::fresh_folder;
using test::Program;
using test::program_path;

constexpr Duration kPatience = from_seconds(60.0);  // a loaded computer is slow

std::unique_ptr<LcmBus> open_bus() {
  (void)setenv(kRunIdVariable, "1", 1);  // NOLINT(concurrency-mt-unsafe): one thread yet
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  RCS_CHECK(bus.ok());
  return std::move(bus).value();
}

/// What is published on the bus, and a WM with a pose.
class Ros2BridgeLive : public testing::Test {
 protected:
  Ros2BridgeLive() {
    nav_state_.pose_valid = nav_state_.world_valid = 1;
    // Heading along y of the world: along-track is y.
    to_message({exp_so3({0.0, 0.0, kPi / 2.0}), {10.0, 20.0, 3.0}}, nav_state_.q_world_vehicle,
               nav_state_.p_world_vehicle_m);
    to_message({Quat::Identity(), {1.0, 2.0, 0.0}}, nav_state_.q_local_vehicle,
               nav_state_.p_local_vehicle_m);
    nav_state_.q_rolling_vehicle[0] = 1.0;
    for (int i = 0; i < 6; ++i) nav_state_.cov_world_pose[i][i] = 0.01;
    nav_state_.cov_world_pose[0][0] = 4.0;
  }

  /// @param tables  of the configuration
  std::string write_config(const std::string& tables) {
    std::string path = (folder_ / "vehicle.toml").string();
    std::ofstream(path) << "[vehicle]\nname = \"demo3\"\n"
                        << "[ladar]\nmount_m = [0.5, 0.0, 1.8]\nmax_range_m = 60.0\n"
                        << tables;
    return path;
  }
  std::unique_ptr<Program> start(const std::string& name, const std::string& config) {
    auto program = std::make_unique<Program>(std::vector<std::string>{program_path(name), config},
                                             std::vector<std::string>{});
    EXPECT_TRUE(run_until([&] { return program->has_said("running on"); })) << program->output();
    return program;
  }
  static std::unique_ptr<Program> client(std::vector<std::string> args) {
    const std::string profile = std::string("CYCLONEDDS_URI=file://") +
                                std::getenv("RCS_SOURCE_DIR") + "/config/dds/loopback.xml";
    args.insert(args.begin(), {program_path("ros2_client"), "-d", "42"});
    return std::make_unique<Program>(args, std::vector<std::string>{profile});
  }
  bool run_until(const std::function<bool()>& done, Duration limit = kPatience) {
    const Stamp end = timeline_.now() + limit;
    while (timeline_.now() < end) {
      while (timeline_.advance(clock_.next()) == Timeline::Step::kDelivered) {
      }
      const Stamp now = timeline_.now();
      if (!clock_.due(now)) return done();  // stopped from outside
      clock_.advance(now);
      nav_state_.utime = wall_utime();
      if (publish_pose_) nav_states_.publish(&nav_state_);
      if (done()) return true;
    }
    return false;
  }
  bool ends(Program* program) {
    return run_until([&] { return program->status() >= 0; });
  }

  fs::path folder_ = fresh_folder();
  StopSignals stop_;
  std::unique_ptr<LcmBus> bus_ = open_bus();
  LiveTimeline timeline_{bus_.get(), &stop_};
  PeriodicClock clock_{from_milliseconds(20.0)};
  Outbox<nav_state_t> nav_states_{bus_.get(), channel::kWmNavState};
  nav_state_t nav_state_{};
  bool publish_pose_ = false;

  std::set<std::int64_t> scans_in_;  // numbers on LADAR_POINTS
  std::set<std::int64_t> scans_registered_;
  std::int64_t registered_points_ = 0;
  int part_count_ = 0;  // messages on SP_POINTS
  std::vector<ins_t> ins_;
  std::vector<gps_fix_t> fixes_;
  std::vector<odometry_t> odometry_;
  std::string events_;
  Tap<ladar_points_t> ladar_tap_{bus_.get(), channel::kLadarPoints,
                                 [this](const ladar_points_t& m, Stamp) {
                                   EXPECT_LE(m.getEncodedSize(), 60'000);
                                   scans_in_.insert(m.scan_id);
                                 }};
  Tap<registration_t> registration_tap_{bus_.get(), channel::kSpRegistration,
                                        [this](const registration_t& m, Stamp) {
                                          scans_registered_.insert(m.scan_id);
                                          registered_points_ += m.points;
                                        }};
  Tap<points_t> points_tap_{bus_.get(), channel::kSpPoints,
                            [this](const points_t&, Stamp) { ++part_count_; }};
  Tap<ins_t> ins_tap_{bus_.get(), channel::kIns,
                      [this](const ins_t& m, Stamp) { ins_.push_back(m); }};
  Tap<gps_fix_t> fix_tap_{bus_.get(), channel::kGpsFix,
                          [this](const gps_fix_t& m, Stamp) { fixes_.push_back(m); }};
  Tap<odometry_t> odometry_tap_{bus_.get(), channel::kOdometry,
                                [this](const odometry_t& m, Stamp) { odometry_.push_back(m); }};
  Tap<event_t> event_tap_{bus_.get(), channel::kRos2BridgeEvent, [this](const event_t& m, Stamp) {
                            events_ += m.code + ": " + m.text + "\n";
                          }};
};

constexpr char kDomain[] = "[ros2_bridge]\ndomain = 42\nsensor_clock = \"utc\"\n";
constexpr char kOutput[] =
    "[ros2_bridge.output]\ntopics = [\"/tf\", \"/wm/pose\", \"/sp/points\"]\n";
constexpr char kCloud[] = "[ros2_bridge.cloud]\ntopic = \"/points\"\nframe_id = \"os_lidar\"\n";

/// The configuration of the whole loop; the stamps of the client may be late on a loaded computer.
std::string both() {
  return std::string(kDomain) + kOutput + "[ros2_bridge.stamps]\nmax_age_ms = 20000\n" + kCloud +
         "[ros2_bridge.imu]\ntopic = \"/imu\"\nframe_id = \"imu_link\"\n"
         "[ros2_bridge.fix]\ntopic = \"/fix\"\nframe_id = \"gps\"\n"
         "[ros2_bridge.odometry]\ntopic = \"/odom\"\nframe_id = \"base_link\"\n";
}

TEST_F(Ros2BridgeLive, ACloudFromRos2DrivesSpAndPositionCloudAndTfReachASubscriber) {
  const std::string config = write_config(both());
  const auto sp = start("sp", config);
  const auto bridge = start("ros2_bridge", config);
  publish_pose_ = true;
  const auto watch = client({"watch", "300"});
  const auto sensors = client({"sensors", "300"});
  const bool all = run_until([&] {
    (void)watch->output();  // a full pipe would stop the client
    return scans_registered_.size() >= 10 && ins_.size() >= 20 && fixes_.size() >= 2 &&
           odometry_.size() >= 5 && watch->has_said("cloud base_link") &&
           watch->has_said("pose map") && watch->has_said("tf map>odom");
  });
  const std::string& seen = watch->output();
  ASSERT_TRUE(all) << "registered " << scans_registered_.size() << ", scans " << scans_in_.size()
                   << "\n"
                   << seen.substr(0, 2000) << "\n"
                   << bridge->output() << events_;

  // The subscriber.
  EXPECT_NE(seen.find("at 10.000 20.000 3.000 variance x 0.0100 y 4.0000"), std::string::npos)
      << "the covariance is along the axes of the map\n"
      << seen.substr(0, 500);
  EXPECT_NE(seen.find("tf odom>base_link at 1.000 2.000 0.000"), std::string::npos);
  EXPECT_NE(seen.find("tf base_link>ladar at 0.500 0.000 1.800"), std::string::npos);
  EXPECT_GT(part_count_, 0);

  // SP.
  EXPECT_GE(*scans_registered_.rbegin() - *scans_registered_.begin(), 9);
  EXPECT_GT(registered_points_, 1000);
  for (const std::int64_t scan : scans_registered_) EXPECT_TRUE(scans_in_.count(scan) > 0) << scan;

  // The other sensors.
  EXPECT_NEAR(ins_.back().delta_v_mps[2] / (1e-6 * ins_.back().interval_us), 9.81, 0.05);
  EXPECT_EQ(fixes_.back().lat_deg, 39.125);
  EXPECT_EQ(fixes_.back().sigma_enu_m[0], 5.0) << "the covariance is unknown";
  EXPECT_EQ(odometry_.back().speed_mps, 1.5);
  EXPECT_NEAR(odometry_.back().sigma_speed_mps, 0.2, 1e-12);
  EXPECT_NE(events_.find("bridge.unsecured"), std::string::npos) << events_;
  std::printf("[  LIVE    ] scans %zu in, %zu registered, INS %zu\n%s", scans_in_.size(),
              scans_registered_.size(), ins_.size(), events_.c_str());
  bridge->signal(SIGTERM);
  ASSERT_TRUE(ends(bridge.get()));
  EXPECT_EQ(bridge->status(), 0) << bridge->output();
}

TEST_F(Ros2BridgeLive, HostileCloudsAreRejectedAndReported) {
  const auto bridge =
      start("ros2_bridge", write_config(std::string(kDomain) + kCloud + "max_rate_hz = 20.0\n"));
  const auto hostile = client({"hostile"});
  ASSERT_TRUE(run_until([&] { return hostile->has_said("fault 7"); })) << hostile->output();
  EXPECT_TRUE(run_until([&] { return events_.find("input.rejected") != std::string::npos; }))
      << events_;
  EXPECT_TRUE(scans_in_.empty());
  ASSERT_TRUE(run_until([&] { return hostile->has_said("flood done"); })) << hostile->output();
  EXPECT_TRUE(run_until([&] { return events_.find("input.flood") != std::string::npos; }))
      << events_;
  ASSERT_TRUE(ends(hostile.get()));
  EXPECT_LT(scans_in_.size(), 500U) << "of 1000 as fast as they can be written";
  EXPECT_LT(bridge->status(), 0) << "it still runs";
  std::printf("[  FLOOD   ] %zu of 1000 clouds accepted, memory %.1f MB\n%s", scans_in_.size(),
              bridge->memory_mb(), events_.c_str());
}

TEST_F(Ros2BridgeLive, BothDirectionsAreOffUnlessTheyAreConfigured) {
  Program nothing({program_path("ros2_bridge"), write_config("[ros2_bridge]\n")}, {});
  ASSERT_TRUE(ends(&nothing));
  EXPECT_EQ(nothing.status(), 3);
  EXPECT_TRUE(nothing.has_said("both directions are off")) << nothing.output();

  publish_pose_ = true;
  {
    const auto bridge = start("ros2_bridge", write_config(std::string(kDomain) + kOutput));
    const auto sensors = client({"sensors", "4"});
    const auto watch = client({"watch", "60"});
    ASSERT_TRUE(run_until([&] { return watch->has_said("pose map"); })) << watch->output();
    ASSERT_TRUE(ends(sensors.get()));
    EXPECT_TRUE(sensors->has_said("readers of /points 0")) << sensors->output();
    EXPECT_TRUE(sensors->has_said("readers of /imu 0")) << sensors->output();
    EXPECT_TRUE(scans_in_.empty() && ins_.empty());
  }
  {
    const auto bridge = start("ros2_bridge", write_config(std::string(kDomain) +
                                                          "[ros2_bridge.stamps]\n"
                                                          "max_age_ms = 20000\n" +
                                                          kCloud));
    const auto sensors = client({"sensors", "30"});
    const auto watch = client({"watch", "4"});
    ASSERT_TRUE(ends(watch.get()));
    EXPECT_TRUE(watch->has_said("received poses 0 clouds 0 tf 0")) << watch->output();
    EXPECT_TRUE(run_until([&] { return !scans_in_.empty(); })) << bridge->output();
    EXPECT_TRUE(ins_.empty()) << "/imu is not in the list";
  }
}

}  // namespace
}  // namespace rcs::ros2_bridge
