#include "modules/ros2_bridge/input_node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/byte_codec.h"
#include "rcs/cdr/cdr_message.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/ros2/nav_types.h"

namespace rcs::ros2_bridge {
namespace {

using testing::HasSubstr;
namespace msg = ros2::msg;

constexpr std::int64_t kUtc_us = 1'800'000'000'000'000;  // UTC at node time 0

msg::Time stamp_of(std::int64_t utc_us) {
  return {static_cast<std::int32_t>(utc_us / 1'000'000),
          static_cast<std::uint32_t>(utc_us % 1'000'000) * 1000U};
}

msg::PointCloud2 cloud(std::uint32_t points, std::int64_t utc_us) {
  msg::PointCloud2 m;
  m.header = {stamp_of(utc_us), "os_lidar"};
  m.height = 1;
  m.width = points;
  m.point_fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}};
  m.point_step = 12;
  m.row_step = 12 * points;
  m.data.resize(std::size_t{12} * points);
  for (std::size_t i = 0; i < points; ++i) {
    wire::put(1.0F + static_cast<float>(i % 500), m.data.data() + 12 * i);
  }
  return m;
}

msg::Imu imu(std::int64_t utc_us) {
  msg::Imu m;
  m.header = {stamp_of(utc_us), "imu_link"};
  m.angular_velocity = {0.1, 0.0, 0.0};
  m.linear_acceleration = {0.0, 0.0, 9.81};
  return m;
}

Ros2BridgeConfig config() {
  Ros2BridgeConfig c;
  c.sensor_clock = SensorClock::kUtc;
  c.cloud.topic = "/points";
  c.cloud.frame_id = "os_lidar";
  c.cloud.max_bytes = 200'000;
  c.sensor_id = 2;
  c.imu.topic = "/imu";
  c.imu.frame_id = "imu_link";
  c.q_vehicle_imu = exp_so3({0.0, 0.0, kPi / 2.0});
  c.fix.topic = "/fix";
  c.fix.frame_id = "gps";
  c.odometry.topic = "/odom";
  c.odometry.frame_id = "base_link";
  return c;
}

constexpr std::size_t kCloud = 0;
constexpr std::size_t kImu = 1;
constexpr std::size_t kFix = 2;
constexpr std::size_t kOdometry = 3;

class InputNode : public testing::Test {
 protected:
  template <class T>
  void receive(std::size_t input, const T& message, std::int64_t now_us,
               std::uint64_t publisher = 8) {
    std::vector<std::uint8_t> cdr;
    cdr::write_message(message, &cdr);
    receive_bytes(input, cdr, now_us, publisher);
  }
  void receive_bytes(std::size_t input, const std::vector<std::uint8_t>& cdr, std::int64_t now_us,
                     std::uint64_t publisher = 8) {
    node_.receive(input, {cdr.data(), cdr.size(), publisher}, kUtc_us, from_utime(now_us));
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(Stamp());
  }
  /// Of the newest event, which is removed.
  std::string event() {
    const event_t* e = events_.latest();
    std::string text = e == nullptr ? "" : e->code + ": " + e->text;
    if (e != nullptr) events_.pop();
    return text;
  }

  LocalBus bus_;
  Inbox<event_t> events_{&bus_, channel::kRos2BridgeEvent, 16};
  Inbox<ladar_points_t> points_{&bus_, channel::kLadarPoints, 64};
  Inbox<ins_t> ins_{&bus_, channel::kIns, 64};
  Inbox<gps_fix_t> fixes_{&bus_, channel::kGpsFix, 64};
  Inbox<odometry_t> odometry_{&bus_, channel::kOdometry, 64};
  Ros2ToBus node_{config(), &bus_};
};

TEST_F(InputNode, ACloudBecomesTheFacetsOfAScan) {
  receive(kCloud, cloud(900, kUtc_us), 1000);
  ASSERT_EQ(points_.size(), 1U);
  const ladar_points_t first = *points_.front();
  points_.pop();
  EXPECT_EQ(first.n, 900);
  EXPECT_EQ(first.utime, kUtc_us) << "the sensors have UTC";
  EXPECT_EQ(first.sensor_id, 2);
  EXPECT_EQ(first.facet_count, 1);
  receive(kCloud, cloud(8000, kUtc_us + 100'000), 101'000);
  ASSERT_EQ(points_.size(), 3U);
  EXPECT_EQ(points_.front()->scan_id, first.scan_id + 1) << "SP counts missing scans by the number";
  EXPECT_EQ(event(), "");
}

TEST_F(InputNode, EachFaultOfACloudIsCountedAndReported) {
  struct Case {
    const char* reason;
    std::function<void(msg::PointCloud2*)> damage;
  };
  const Case kCases[] = {
      {"another frame_id", [](auto* m) { m->header.frame_id = "camera"; }},
      {"invalid stamp", [](auto* m) { m->header.stamp.nanosec = 1'000'000'000; }},
      {"invalid stamp", [](auto* m) { m->header.stamp.sec = -1; }},
      {"stamp in the future", [](auto* m) { m->header.stamp.sec += 10; }},
      {"stamp older than max_age_ms", [](auto* m) { m->header.stamp.sec -= 10; }},
      {"larger than max_kbytes", [](auto* m) { m->data.resize(200'001); }},
      {"more points than max_points", [](auto* m) { m->width = 0xFFFFFFFF; }},
      {"field outside of point_step", [](auto* m) { m->point_step = 11; }},
      {"row_step or data contradicts", [](auto* m) { m->data.pop_back(); }},
      {"no fields x, y and z", [](auto* m) { m->point_fields.pop_back(); }},
      {"big-endian", [](auto* m) { m->is_bigendian = true; }},
      {"no valid point", [](auto* m) { std::fill(m->data.begin(), m->data.end(), 0xFF); }},
  };
  std::int64_t rejected = 0;
  std::int64_t now_us = 1000;
  for (const Case& c : kCases) {
    now_us += 10'000'000;  // beyond the report interval
    msg::PointCloud2 m = cloud(100, kUtc_us + now_us);
    c.damage(&m);
    receive(kCloud, m, now_us);
    EXPECT_THAT(event(),
                HasSubstr("input.rejected: /points: message rejected: " + std::string(c.reason)));
    EXPECT_EQ(node_.counts(kCloud).rejected, ++rejected);
  }
  EXPECT_TRUE(points_.empty());
  // None of them has become the newest stamp.
  receive(kCloud, cloud(100, kUtc_us + now_us), now_us);
  EXPECT_EQ(points_.size(), 1U);
}

TEST_F(InputNode, MalformedBytesAreRejected) {
  for (const std::vector<std::uint8_t>& bytes :
       {std::vector<std::uint8_t>{}, std::vector<std::uint8_t>{0, 1, 0, 0},
        std::vector<std::uint8_t>{0, 7, 0, 0, 1, 2, 3, 4}, std::vector<std::uint8_t>(100, 0xFF)}) {
    for (const std::size_t input : {kCloud, kImu, kFix, kOdometry}) {
      receive_bytes(input, bytes, 1000);
    }
  }
  for (const std::size_t input : {kCloud, kImu, kFix, kOdometry}) {
    EXPECT_EQ(node_.counts(input).rejected, 4) << input;
    EXPECT_EQ(node_.counts(input).accepted, 0) << input;
  }
  EXPECT_THAT(event(), HasSubstr("malformed message"));
}

TEST_F(InputNode, AFloodAndASecondPublisherAreReportedByTheirEvents) {
  for (int i = 0; i < 1000; ++i) receive(kFix, msg::NavSatFix{}, 1000 + i);
  EXPECT_GT(node_.counts(kFix).flood, 990);
  bool flood = false;
  for (; !events_.empty(); events_.pop()) flood = flood || events_.front()->code == "input.flood";
  EXPECT_TRUE(flood);
  receive(kCloud, cloud(100, kUtc_us), 1000, 8);
  receive(kCloud, cloud(100, kUtc_us + 50'000), 51'000, 16);
  EXPECT_THAT(event(), HasSubstr("a second publisher"));
  EXPECT_EQ(points_.size(), 1U);
}

TEST_F(InputNode, AnImuGivesIncrementsInTheAxesOfTheVehicle) {
  receive(kImu, imu(kUtc_us), 1000);
  EXPECT_TRUE(ins_.empty()) << "the first one begins the interval";
  receive(kImu, imu(kUtc_us + 5000), 6000);
  ASSERT_EQ(ins_.size(), 1U);
  EXPECT_EQ(ins_.front()->interval_us, 5000);
  EXPECT_NEAR(ins_.front()->delta_angle_rad[1], 0.1 * 0.005, 1e-12) << "x of the IMU is y";
  EXPECT_NEAR(ins_.front()->delta_v_mps[2], 9.81 * 0.005, 1e-12);
  EXPECT_EQ(ins_.front()->valid, 1);
  msg::Imu bad = imu(kUtc_us + 10'000);
  bad.linear_acceleration.x = std::numeric_limits<double>::quiet_NaN();
  receive(kImu, bad, 11'000);
  EXPECT_THAT(event(), HasSubstr("/imu: message rejected: a value is not finite"));
  receive(kImu, imu(kUtc_us + 5000), 12'000);
  receive(kImu, imu(kUtc_us + 10'000), 13'000);
  EXPECT_EQ(ins_.size(), 2U);
  EXPECT_EQ(node_.counts(kImu).rejected, 2);
  // A gap that is longer than an interval may be: WM sees that samples are missing.
  receive(kImu, imu(kUtc_us + 2'000'000), 2'001'000);
  EXPECT_EQ(ins_.size(), 2U);
  receive(kImu, imu(kUtc_us + 2'005'000), 2'006'000);
  EXPECT_EQ(ins_.size(), 3U);
}

TEST_F(InputNode, WithTheNodeClockStampsBecomeNodeTime) {
  Ros2BridgeConfig c = config();
  c.sensor_clock = SensorClock::kNode;
  Ros2ToBus node(c, &bus_);
  std::vector<std::uint8_t> cdr;
  cdr::write_message(cloud(10, kUtc_us + 777), &cdr);
  node.receive(kCloud, {cdr.data(), cdr.size(), 8}, kUtc_us, from_utime(1000));
  bus_.deliver_next(Stamp());
  EXPECT_EQ(points_.front()->utime, 777);
}

TEST_F(InputNode, OnlyConfiguredInputsExist) {
  Ros2BridgeConfig c = config();
  c.cloud.topic.clear();
  c.fix.topic.clear();
  const Ros2ToBus node(c, &bus_);
  const std::vector<DdsInput> inputs = node.inputs();
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_EQ(inputs[0].topic, "/imu");
  EXPECT_EQ(inputs[0].type, "sensor_msgs/Imu");
  EXPECT_EQ(inputs[1].topic, "/odom");
}

}  // namespace
}  // namespace rcs::ros2_bridge
