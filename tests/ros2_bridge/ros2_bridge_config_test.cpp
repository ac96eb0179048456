#include "modules/ros2_bridge/ros2_bridge_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace rcs::ros2_bridge {
namespace {

using testing::HasSubstr;

Result<Ros2BridgeConfig> load(const std::string& text) {
  const Result<ParamFile> file = ParamFile::parse(text, "vehicle.toml");
  if (!file) return file.error();
  return load_ros2_bridge_config(*file);
}

std::string error(const std::string& text) {
  const Result<Ros2BridgeConfig> config = load(text);
  return config ? "" : config.error().message;
}

constexpr char kOutput[] = "[ros2_bridge.output]\ntopics = [\"/tf\"]\n";
constexpr char kUtc[] = "[ros2_bridge]\nsensor_clock = \"utc\"\n";

std::string cloud(const std::string& topic) {
  return std::string(kUtc) + "[ros2_bridge.cloud]\ntopic = \"" + topic +
         "\"\nframe_id = \"os_lidar\"\n";
}

TEST(Ros2BridgeConfig, BothDirectionsAreOffByDefault) {
  const Ros2BridgeConfig defaults;
  EXPECT_TRUE(defaults.output.topics.empty());
  for (const InputConfig* i : {&defaults.cloud, &defaults.imu, &defaults.fix, &defaults.odometry}) {
    EXPECT_FALSE(i->on());
  }
  for (const char* text : {"", "[ros2_bridge]\n", "[ros2_bridge.cloud]\nframe_id = \"x\"\n"}) {
    EXPECT_THAT(error(text), HasSubstr("both directions are off")) << text;
  }
}

TEST(Ros2BridgeConfig, EachDirectionIsSetAlone) {
  const auto output = load(kOutput);
  ASSERT_TRUE(output.ok()) << output.error().message;
  EXPECT_FALSE(output->cloud.on());
  EXPECT_FALSE(output->T_vehicle_ladar.has_value());
  const auto input = load(cloud("/points") + "max_kbytes = 20\n[ladar]\nsensor_id = 3\n" +
                          "mount_m = [0.0, 0.0, 2.0]\n[ros2_bridge.imu]\n"
                          "mount_rpy_deg = [0.0, 0.0, 90.0]\n");
  ASSERT_TRUE(input.ok()) << input.error().message;
  EXPECT_TRUE(input->output.topics.empty());
  EXPECT_EQ(input->cloud.max_bytes, 20'000U);
  EXPECT_EQ(input->sensor_id, 3);
  EXPECT_EQ(input->T_vehicle_ladar->p.z(), 2.0);
  EXPECT_NEAR((input->q_vehicle_imu * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-12);
  EXPECT_GE(input->max_sample_bytes(), 4'000'000U) << "outputs have clouds and maps";
}

TEST(Ros2BridgeConfig, AnErrorNamesFileLineKeyAndRange) {
  struct Case {
    std::string text;
    const char* expected;
  };
  const Case kCases[] = {
      {std::string("[ros2_bridge]\ndomain = 233\n") + kOutput,
       "vehicle.toml:2: [ros2_bridge] domain = 233: not in [0, 232]"},
      {"[ros2_bridge.output]\ntopics = [\"/tf\"]\nmax_rate_hz = 0.0\n",
       "vehicle.toml:3: [ros2_bridge.output] max_rate_hz = 0.0: not in [0.1, 1000] (Hz)"},
      {"[ros2_bridge.output]\ntopics = [\"/cmd_vel\"]\n", "/cmd_vel is not one of /ladar/points"},
      {"[ros2_bridge.output]\ntopics = [\"/tf\", \"/tf\"]\n", "/tf is there twice"},
      {std::string(kOutput) + "[ros2_bridge.could]\n", "did you mean cloud"},
      {std::string("[ros2_bridge]\ninterface = \"lo\\\"/><x\"\n") + kOutput, "interface"},
      {std::string("[ros2_bridge]\npeers = [\"a b\"]\n") + kOutput, "peers"},
      {cloud("points"), "must be an absolute name"},
      {cloud("/points/"), "must be an absolute name"},
      {cloud("/a b"), "must be an absolute name"},
      {cloud("/sp/points"), "is a topic that the bridge itself publishes"},
      {std::string(kUtc) + "[ros2_bridge.cloud]\ntopic = \"/points\"\n", "frame_id: must be set"},
      {"[ros2_bridge.cloud]\ntopic = \"/points\"\nframe_id = \"x\"\n",
       "sensor_clock: must be \"utc\" or \"node\" with an input"},
      {cloud("/points") + "[ros2_bridge.imu]\ntopic = \"/points\"\nframe_id = \"x\"\n",
       "[ros2_bridge.imu] topic = '/points': is the topic of another input, too"},
      {cloud("/points") + "max_points = 600000\n", "max_points = 600000: not in [100, 500000]"},
      {cloud("/points") + "[ros2_bridge.stamps]\nmax_age_ms = 1.0\n",
       "max_age_ms = 1.0: not in [10, "},
  };
  for (const Case& c : kCases) EXPECT_THAT(error(c.text), HasSubstr(c.expected)) << c.text;
}

}  // namespace
}  // namespace rcs::ros2_bridge
