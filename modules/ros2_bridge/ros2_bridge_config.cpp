#include "modules/ros2_bridge/ros2_bridge_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "rcs/node/params/ladar_mount.h"
#include "rcs/node/params/vehicle_tables.h"
#include "rcs/ros2/converter.h"

namespace rcs::ros2_bridge {
namespace {

/// "/points", "/os/points": absolute names of ROS 2.
bool is_topic(std::string_view text) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_/";
  constexpr std::size_t kLongest = 200;
  return text.size() >= 2 && text.size() <= kLongest && text.front() == '/' && text.back() != '/' &&
         text.find("//") == std::string_view::npos &&
         text.find_first_not_of(kAllowed) == std::string_view::npos;
}

bool is_output(std::string_view name) {
  bool found = false;
  ros2::for_each_topic([&](const auto& topic) { found = found || name == topic.name; });
  return found;
}

std::string output_names() {
  std::string all;
  ros2::for_each_topic(
      [&](const auto& topic) { all += (all.empty() ? "" : ", ") + std::string(topic.name); });
  return all;
}

void read_output(ParamTable table, OutputConfig* p) {
  table.get("topics", &p->topics,
            "Topics that are published to ROS 2, e.g. [\"/tf\", \"/wm/pose\", \"/sp/points\"]. "
            "Empty: none.");
  for (const std::string& topic : p->topics) {
    if (!is_output(topic)) {
      table.fail("topics", fmt::format("{} is not one of {}", topic, output_names()));
    }
    if (std::count(p->topics.begin(), p->topics.end(), topic) > 1) {
      table.fail("topics", fmt::format("{} is there twice", topic));
      break;
    }
  }
  int kbytes = static_cast<int>(p->max_bytes_per_s / 1000);
  table.get("max_kbytes_per_s", &kbytes, {10, 1'000'000},
            "Largest number of kilobytes that are published to ROS 2 in a second. Messages above "
            "4 kB may use four fifths of it.");
  p->max_bytes_per_s = static_cast<std::size_t>(kbytes) * 1000;
  constexpr Range kRate_hz{0.1, 1000};
  const auto rate = [](Duration period) { return 1.0 / seconds(period); };
  double rate_hz = rate(p->period);
  table.get(
      "max_rate_hz", &rate_hz, kRate_hz,
      "Largest rate of each published topic that is neither a cloud nor a map. Topics /rosout "
      "and /diagnostics are limited by the bytes alone.");
  double cloud_rate_hz = rate(p->cloud_period);
  table.get("max_cloud_rate_hz", &cloud_rate_hz, kRate_hz,
            "Largest rate of each published topic of type PointCloud2.");
  double map_rate_hz = rate(p->map_period);
  table.get("max_map_rate_hz", &map_rate_hz, kRate_hz,
            "Largest rate of each published topic of type OccupancyGrid or GridMap.");
  p->period = from_seconds(1.0 / rate_hz);
  p->cloud_period = from_seconds(1.0 / cloud_rate_hz);
  p->map_period = from_seconds(1.0 / map_rate_hz);
}

void read_stamps(ParamTable table, StampLimits* p) {
  table.get_ms("max_age_ms", &p->max_age, {10, 1e13},
               "Largest age of the stamp of a message from ROS 2; an older one is rejected. A "
               "recording that is played needs a large value.");
  table.get_ms("max_ahead_ms", &p->max_ahead, {0, 10000},
               "Largest time by which the stamp of a message from ROS 2 may be after the UTC clock "
               "of this computer; a later one is rejected.");
  table.get_ms("restart_after_ms", &p->restart_after, {100, 60000},
               "Time for which stamps before the last accepted one must increase until the source "
               "counts as restarted; until then they are rejected.");
}

struct InputLimits {
  Range rate_hz;
  Range kbytes;
};

/// The keys that all inputs have. The texts are literals, because descriptions outlive the parser.
void read_input(ParamTable* table, InputConfig* p, const InputLimits& limits) {
  table->get("topic", &p->topic,
             "Topic of ROS 2 that is received, e.g. \"/sensor/data\". Empty: this input is off.");
  table->get(
      "frame_id", &p->frame_id,
      "Frame that the messages must state (Odometry: child_frame_id). Messages with another one "
      "are rejected.");
  table->get("max_rate_hz", &p->max_rate_hz, limits.rate_hz,
             "Largest mean rate of the messages; messages above it are rejected.");
  int kbytes = static_cast<int>((p->max_bytes + 999) / 1000);
  table->get("max_kbytes", &kbytes, limits.kbytes,
             "Largest size of a message in kilobytes; a larger one is rejected.");
  p->max_bytes = static_cast<std::size_t>(kbytes) * 1000;
  if (!p->on()) return;
  if (!is_topic(p->topic)) table->fail("topic", "must be an absolute name, e.g. \"/points\"");
  if (is_output(p->topic)) {
    table->fail("topic", "is a topic that the bridge itself publishes: rename that of the driver");
  }
  if (p->frame_id.empty()) table->fail("frame_id", "must be set if topic is");
}

void read_inputs(ParamTable* root, Ros2BridgeConfig* c) {
  constexpr Range kSmall_kb{1, 100};
  ParamTable cloud = root->table("cloud");
  read_input(&cloud, &c->cloud, {{0.1, 100}, {1, 64'000}});
  int points = static_cast<int>(c->cloud_limits.max_points);
  cloud.get("max_points", &points, {100, 500'000},
            "Largest number of points of a cloud; a cloud with more is rejected.");
  c->cloud_limits.max_points = static_cast<std::size_t>(points);
  cloud.get("max_range_m", &c->cloud_limits.max_range_m, {1, 10'000},
            "Largest distance of a point from the LADAR; farther points are omitted.");
  cloud.get_ms("max_duration_ms", &c->cloud_limits.max_duration, {1, 4000},
               "Largest time between two points of a cloud, and between a point and the stamp; a "
               "cloud with a larger one is rejected.");

  ParamTable imu = root->table("imu");
  read_input(&imu, &c->imu, {{1, 2000}, kSmall_kb});
  Vec3 rpy_deg = Vec3::Zero();
  imu.get("mount_rpy_deg", &rpy_deg, {-360, 360},
          "Roll, pitch and yaw of the IMU in the vehicle: R = Rz(yaw) Ry(pitch) Rx(roll). Its "
          "position is the origin of the vehicle frame.");
  c->q_vehicle_imu = Eigen::AngleAxisd(radians(rpy_deg.z()), Vec3::UnitZ()) *
                     Eigen::AngleAxisd(radians(rpy_deg.y()), Vec3::UnitY()) *
                     Eigen::AngleAxisd(radians(rpy_deg.x()), Vec3::UnitX());

  ParamTable fix = root->table("fix");
  read_input(&fix, &c->fix, {{0.1, 100}, kSmall_kb});
  fix.get("default_sigma_m", &c->fix_sigma_m, {0.001, 200},
          "Standard deviation east, north and up of a fix whose covariance is unknown.");

  ParamTable odometry = root->table("odometry");
  read_input(&odometry, &c->odometry, {{1, 1000}, kSmall_kb});
  odometry.get("default_sigma_mps", &c->odometry_sigma_mps, {0.001, 10},
               "Standard deviation of a speed whose variance is unknown.");

  const std::array<const InputConfig*, 4> all = {&c->cloud, &c->imu, &c->fix, &c->odometry};
  const std::array<ParamTable*, 4> tables = {&cloud, &imu, &fix, &odometry};
  const bool any = std::any_of(all.begin(), all.end(), [](const auto* i) { return i->on(); });
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = i + 1; k < all.size(); ++k) {
      if (all[i]->on() && all[i]->topic == all[k]->topic) {
        tables[k]->fail("topic", "is the topic of another input, too");
      }
    }
  }
  if (any && c->sensor_clock == SensorClock::kMeasured) {
    root->fail("sensor_clock",
               "must be \"utc\" or \"node\" with an input, because stamps of ROS 2 become sensor "
               "time: \"utc\" if all sensors come from ROS 2");
  }
  if (!any && c->output.topics.empty()) {
    root->fail("output",
               "names no topics, and no input has a topic: both directions are off, nothing to do");
  }
}

}  // namespace

std::size_t Ros2BridgeConfig::max_sample_bytes() const {
  // Of an output: a scan of 2^16 points and a map patch are below.
  std::size_t most = 4'000'000;
  for (const InputConfig* input : {&cloud, &imu, &fix, &odometry}) {
    if (input->on()) most = std::max(most, 2 * input->max_bytes);
  }
  return most;
}

Result<Ros2BridgeConfig> load_ros2_bridge_config(const ParamFile& file) {
  Ros2BridgeConfig c;
  ParamTable table = file.root().table("ros2_bridge");
  table.get_ms("budget_ms", &c.info.budget, {1, 1000},
               "Deadline of a cycle after its wakeup; a cycle that ends later is an overrun.");
  table.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000},
               "Compute time by which a replay delays the output of a cycle.");
  table.get_ms("period_ms", &c.period, {1, 100},
               "Period of the cycle of the bridge; it delays each message by up to this time.");
  std::string clock = "measured";
  table.get(
      "sensor_clock", &clock, {"measured", "utc", "node"},
      "Clock of the stamps of all sensors of the vehicle: \"utc\", \"node\" (CLOCK_MONOTONIC), "
      "or \"measured\" (any; its offset to UTC is measured by arrivals, for outputs only).");
  if (clock == "utc") c.sensor_clock = SensorClock::kUtc;
  if (clock == "node") c.sensor_clock = SensorClock::kNode;
  dds::read_network(&table, &c.dds, "DDS domain of the ROS 2 nodes: their ROS_DOMAIN_ID.");
  read_output(table.table("output"), &c.output);
  read_stamps(table.table("stamps"), &c.stamps);
  read_inputs(&table, &c);

  ParamTable root = file.root();
  if (root.has("ladar")) {
    ParamTable ladar = root.table("ladar");
    ladar.get("sensor_id", &c.sensor_id, {0, 32767},
              "Identifier of the LADAR; facets with another sensor_id are rejected.");
    Pose mount;
    read_ladar_mount(ladar, &mount);
    c.T_vehicle_ladar = mount;
  }
  if (Outcome read_all = file.finish(tables_but({"ros2_bridge"})); !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::ros2_bridge
