#include "modules/ros2_bridge/output_node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "rcs/cdr/cdr_message.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/local_bus.h"

namespace rcs::ros2_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kUtc_us = 1'800'000'000'000'000;  // UTC at node time 0

template <class T>
std::vector<std::uint8_t> encoded(const T& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_GT(message.encode(bytes.data(), 0, message.getEncodedSize()), 0);
  return bytes;
}

nav_state_t nav_state(std::int64_t utime) {
  nav_state_t m{};
  m.utime = utime;
  m.seq = 1;
  m.pose_valid = m.world_valid = 1;
  to_message({Quat::Identity(), {1.0, 2.0, 3.0}}, m.q_world_vehicle, m.p_world_vehicle_m);
  m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
  return m;
}

class OutputNode : public testing::Test {
 protected:
  void make(const std::vector<std::string>& topics, SensorClock clock = SensorClock::kUtc,
            std::size_t max_bytes_per_s = 1'000'000) {
    Ros2BridgeConfig c;
    c.output.topics = topics;
    c.output.max_bytes_per_s = max_bytes_per_s;
    c.sensor_clock = clock;
    for (const DdsOutput& output : outputs_of(c.output)) names_.push_back(output.topic);
    nodes_.push_back(std::make_unique<BusToRos2>(
        c, &bus_, [this](std::size_t output, const std::vector<std::uint8_t>& cdr) {
          written_[names_.at(output)].push_back(cdr);
          return accepts_;
        }));
    node_ = nodes_.back().get();
  }
  template <class T>
  void deliver(std::string_view channel, const T& message, std::int64_t now_us) {
    const std::vector<std::uint8_t> bytes = encoded(message);
    bus_.deliver(channel, bytes.data(), bytes.size(), from_utime(now_us));
  }
  void run(std::int64_t now_us) {
    node_->run(kUtc_us, from_utime(now_us), &report_);
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(Stamp());
  }
  ros2::msg::PoseWithCovarianceStamped pose(std::size_t i) {
    ros2::msg::PoseWithCovarianceStamped m;
    const std::vector<std::uint8_t>& cdr = written_["/wm/pose"].at(i);
    EXPECT_TRUE(cdr::read_message(cdr.data(), cdr.size(), &m));
    return m;
  }

  LocalBus bus_;
  Inbox<event_t> events_{&bus_, channel::kRos2BridgeEvent, 16};
  Report report_{&bus_, "ros2_bridge", from_seconds(5.0)};
  std::vector<std::string> names_;
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> written_;
  bool accepts_ = true;
  std::vector<std::unique_ptr<BusToRos2>> nodes_;  // receivers must outlive the bus's deliveries
  BusToRos2* node_ = nullptr;
};

TEST_F(OutputNode, OnlySelectedTopicsArePublishedAndAtTheirRate) {
  make({"/tf", "/wm/pose"});
  for (int t = 0; t < 1000; t += 10) {
    if (t % 20 == 0) deliver(channel::kWmNavState, nav_state(kUtc_us + 1000LL * t), 1000LL * t);
    run(1000LL * t);
  }
  EXPECT_THAT(names_, ElementsAre("/wm/pose", "/tf"));
  EXPECT_EQ(written_.size(), 2U);
  EXPECT_NEAR(static_cast<double>(written_["/tf"].size()), 20.0, 1.0) << "50 Hz in, 20 Hz out";
  EXPECT_EQ(written_["/wm/pose"].size(), written_["/tf"].size());
  EXPECT_EQ(pose(0).pose.pose.position.y, 2.0);
  EXPECT_EQ(pose(0).header.stamp.sec, kUtc_us / 1'000'000);
  EXPECT_GT(node_->counts().decimated, 40);
  EXPECT_TRUE(events_.empty());
}

TEST_F(OutputNode, StampsAreUtcWhateverTheClockOfTheSensors) {
  struct Case {
    SensorClock clock;
    std::int64_t sensor_minus_node_us;
    std::int64_t tolerance_us;
  };
  constexpr std::int64_t kDelay_us = 2000;  // of the sensor message
  for (const Case& c :
       {Case{SensorClock::kUtc, kUtc_us, 0}, Case{SensorClock::kNode, 0, 0},
        Case{SensorClock::kMeasured, kUtc_us, 0}, Case{SensorClock::kMeasured, 0, 0},
        Case{SensorClock::kMeasured, 123'456'789'000, kDelay_us}}) {
    written_.clear();
    names_.clear();
    make({"/wm/pose"}, c.clock);
    ins_t ins{};
    ins.utime = 50'000 + c.sensor_minus_node_us;
    deliver(channel::kIns, ins, 50'000 + kDelay_us);
    deliver(channel::kWmNavState, nav_state(100'000 + c.sensor_minus_node_us), 110'000);
    run(110'000);
    const ros2::msg::Time stamp = pose(0).header.stamp;
    const std::int64_t us = std::int64_t{stamp.sec} * 1'000'000 + stamp.nanosec / 1000;
    EXPECT_NEAR(static_cast<double>(us - kUtc_us), 100'000.0, static_cast<double>(c.tolerance_us));
  }
}

TEST_F(OutputNode, WithoutASensorOnlyNodeTimeIsKnown) {
  make({"/tf", "/rosout"}, SensorClock::kMeasured);
  event_t event{};
  event.utime = 5000;
  event.node = "wm";
  deliver(channel::kWmNavState, nav_state(100'000), 110'000);
  deliver(channel::kWmEvent, event, 110'000);
  run(110'000);
  EXPECT_EQ(written_.count("/tf"), 0U);
  EXPECT_EQ(written_["/rosout"].size(), 1U);
}

TEST_F(OutputNode, LossesAreCountedAndReported) {
  make({"/wm/grid_map", "/tf", "/rosout"}, SensorClock::kUtc, 3000);
  accepts_ = false;
  deliver(channel::kWmNavState, nav_state(kUtc_us), 0);
  run(0);
  ASSERT_EQ(events_.size(), 1U);
  EXPECT_EQ(events_.front()->code, "dds.write");
  events_.pop();
  accepts_ = true;
  event_t event{};
  event.node = "wm";
  event.text = std::string(200, 'x');
  for (int i = 0; i < 100; ++i) {
    event.utime = i;
    deliver(channel::kWmEvent, event, 1000);
  }
  run(1000);
  EXPECT_GT(node_->counts().over_budget, 80);
  ASSERT_EQ(events_.size(), 1U);
  EXPECT_THAT(events_.front()->text, HasSubstr("byte budget exhausted"));
  std::size_t bytes = 0;
  for (const auto& [topic, all] : written_) {
    for (const auto& cdr : all) bytes += cdr.size();
  }
  EXPECT_LE(bytes, 3000U);
}

TEST_F(OutputNode, MoreMessagesThanCanWaitAreDropped) {
  make({"/tf"});
  for (int i = 0; i < 1000; ++i) deliver(channel::kWmNavState, nav_state(kUtc_us + i), i);
  run(1000);
  EXPECT_EQ(node_->counts().waiting, 1000 - 512);
  EXPECT_EQ(written_["/tf"].size(), 1U);
}

TEST_F(OutputNode, MalformedMessagesAndASecondPublisherAreNotPublished) {
  make({"/tf"});
  const std::vector<std::uint8_t> shorter(39, 1);
  const std::vector<std::uint8_t> other(400, 1);
  bus_.deliver(channel::kWmNavState, shorter.data(), shorter.size(), from_utime(0));
  bus_.deliver(channel::kWmNavState, other.data(), other.size(), from_utime(0));
  run(0);
  EXPECT_EQ(node_->counts().malformed, 2);
  EXPECT_TRUE(written_.empty());
  nav_state_t foreign = nav_state(kUtc_us);
  foreign.run_id = 77;
  deliver(channel::kWmNavState, foreign, 10'000);
  run(10'000);
  EXPECT_TRUE(written_.empty()) << "an output of another run";
}

TEST(ChannelsOf, NamesAndEndings) {
  EXPECT_THAT(channels_of("LADAR_POINTS, LADAR_RANGES"),
              ElementsAre("LADAR_POINTS", "LADAR_RANGES"));
  EXPECT_THAT(channels_of("*_EVENT"),
              ElementsAre("SP_EVENT", "WM_EVENT", "BG_EVENT", "MISSION_EVENT", "GATEWAY_EVENT",
                          "ROS2_BRIDGE_EVENT", "UP_EVENT", "RECORD_EVENT"));
  EXPECT_TRUE(channels_of("NOTHING").empty());
  ros2::for_each_topic(
      [](const auto& topic) { EXPECT_FALSE(channels_of(topic.from).empty()) << topic.name; });
}

}  // namespace
}  // namespace rcs::ros2_bridge
