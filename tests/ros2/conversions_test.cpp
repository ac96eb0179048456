// Messages of this system as messages of ROS 2: values, units, frames, invalid input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "lcmtypes/convert.h"
#include "rcs/base/byte_codec.h"
#include "rcs/ros2/converter.h"
#include "rcs/ros2/sensor_messages.h"
#include "rcs/ros2/status_messages.h"
#include "rcs/ros2/terrain_messages.h"

namespace rcs::ros2 {
namespace {

using testing::ElementsAre;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
const ClockOffsets kClocks = {1'000'000, 2'000'000};

nav_state_t nav_state() {
  nav_state_t m{};
  m.utime = 5'000'000;
  m.pose_valid = m.world_valid = m.rolling_valid = 1;
  // The vehicle heads along y of the world and along x of frame local.
  to_message({exp_so3({0.0, 0.0, kPi / 2.0}), {10.0, 20.0, 3.0}}, m.q_world_vehicle,
             m.p_world_vehicle_m);
  to_message({Quat::Identity(), {1.0, 0.0, 0.0}}, m.q_local_vehicle, m.p_local_vehicle_m);
  to_message({Quat::Identity(), {0.5, 0.0, 0.0}}, m.q_rolling_vehicle, m.p_rolling_vehicle_m);
  m.v_world_mps[1] = 2.0;
  m.rate_vehicle_radps[2] = 0.3;
  m.cov_v_world[1][1] = 0.04;
  m.cov_world_pose[0][0] = 4.0;
  m.cov_world_pose[1][1] = 1.0;
  m.cov_world_pose[2][2] = 0.25;
  return m;
}

TEST(Nav, PoseOdometryAndTransformsAgree) {
  const Pose T_vehicle_ladar = {Quat::Identity(), {1.0, 0.0, 1.5}};
  const auto nav = to_nav(nav_state(), kClocks, T_vehicle_ladar);
  ASSERT_TRUE(nav.has_value());
  EXPECT_EQ(nav->pose.header.stamp.sec, 6);
  EXPECT_EQ(nav->pose.header.frame_id, "map");
  EXPECT_EQ(nav->pose.pose.pose.position.y, 20.0);
  EXPECT_NEAR(nav->pose.pose.covariance[7], 4.0, 1e-12) << "along-track is y of the map";
  EXPECT_EQ(nav->odometry.child_frame_id, "base_link");
  EXPECT_NEAR(nav->odometry.twist.twist.linear.x, 2.0, 1e-12) << "in the axes of the vehicle";
  EXPECT_NEAR(nav->odometry.twist.covariance[0], 0.04, 1e-12);
  EXPECT_EQ(nav->odometry.twist.covariance[35], kUnknownVariance);
  ASSERT_EQ(nav->tf.transforms.size(), 4U);
  const auto pose_of = [](const msg::TransformStamped& t) {
    const auto& q = t.transform.rotation;
    const auto& p = t.transform.translation;
    return Pose{Quat(q.w, q.x, q.y, q.z), {p.x, p.y, p.z}};
  };
  const auto& tf = nav->tf.transforms;
  EXPECT_EQ(tf[0].header.frame_id + ">" + tf[0].child_frame_id, "map>odom");
  EXPECT_EQ(tf[1].header.frame_id + ">" + tf[1].child_frame_id, "odom>base_link");
  EXPECT_EQ(tf[2].header.frame_id + ">" + tf[2].child_frame_id, "odom>rolling");
  EXPECT_EQ(tf[3].header.frame_id + ">" + tf[3].child_frame_id, "base_link>ladar");
  const Pose T_map_base = pose_of(tf[0]) * pose_of(tf[1]);
  EXPECT_NEAR((T_map_base.p - Vec3(10.0, 20.0, 3.0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(yaw_of(T_map_base.q), kPi / 2.0, 1e-12);
  EXPECT_NEAR(pose_of(tf[2]).p.x(), 0.5, 1e-12);
}

TEST(Nav, AnInvalidPoseIsNotPublished) {
  nav_state_t m = nav_state();
  m.pose_valid = 0;
  EXPECT_FALSE(to_nav(m, kClocks, std::nullopt).has_value());
  m = nav_state();
  m.cov_world_pose[4][4] = kNan;
  EXPECT_FALSE(to_nav(m, kClocks, std::nullopt).has_value());
  m = nav_state();
  m.q_local_vehicle[0] = 7.0;
  EXPECT_FALSE(to_nav(m, kClocks, std::nullopt).has_value());
  m = nav_state();
  m.rolling_valid = 0;
  EXPECT_EQ(to_nav(m, kClocks, std::nullopt)->tf.transforms.size(), 2U);
}

TEST(Bounds, SigmaAndProtectionLevelAreTwoMarkers) {
  integrity_t i{};
  i.validity = integrity_t::VALID_WORLD;
  i.protection_horizontal_m = 3.0;
  i.protection_vertical_m = 5.0;
  auto bounds = to_bounds(nav_state(), i, kClocks);
  ASSERT_TRUE(bounds.has_value());
  ASSERT_EQ(bounds->markers.size(), 2U);
  const msg::Marker& sigma = bounds->markers[0];
  EXPECT_NEAR(sigma.scale.x, 6.0 * 0.5, 1e-9) << "the axes ascend: up, left, forward";
  EXPECT_NEAR(sigma.scale.z, 6.0 * 2.0, 1e-9);
  const Quat q(sigma.pose.orientation.w, sigma.pose.orientation.x, sigma.pose.orientation.y,
               sigma.pose.orientation.z);
  EXPECT_NEAR(std::abs((q * Vec3::UnitZ()).y()), 1.0, 1e-9) << "the longest is y of the map";
  const msg::Marker& level = bounds->markers[1];
  EXPECT_EQ(level.action, 0);
  EXPECT_EQ(level.scale.x, 6.0);
  EXPECT_EQ(level.scale.z, 10.0);
  EXPECT_NE(level.color.r, sigma.color.r);
  i.protection_horizontal_m = kInf;
  bounds = to_bounds(nav_state(), i, kClocks);
  EXPECT_EQ(bounds->markers[1].action, 2) << "deleted: no bound is known";
}

TEST(Sensors, AFixHasAnEllipsoidalAltitude) {
  gps_fix_t m{};
  m.lat_deg = 48.0;
  m.lon_deg = 11.0;
  m.height_m = 500.0;
  m.height_kind = gps_fix_t::HEIGHT_ORTHOMETRIC;
  m.undulation_m = 46.0;
  m.fix_type = gps_fix_t::FIX_FIXED;
  m.sigma_enu_m[0] = 0.1;
  m.sigma_enu_m[1] = 0.2;
  m.sigma_enu_m[2] = 0.5;
  auto fix = to_nav_sat_fix(m, kClocks);
  EXPECT_EQ(fix->altitude, 546.0);
  EXPECT_EQ(fix->status.status, 2);
  EXPECT_NEAR(fix->position_covariance[4], 0.04, 1e-12);
  EXPECT_EQ(fix->position_covariance_type, 2);
  m.undulation_m = kNan;
  m.sigma_enu_m[0] = 0.0;
  m.fix_type = gps_fix_t::FIX_NONE;
  fix = to_nav_sat_fix(m, kClocks);
  EXPECT_TRUE(std::isnan(fix->altitude));
  EXPECT_EQ(fix->status.status, -1);
  EXPECT_EQ(fix->position_covariance_type, 0);
  m.lat_deg = kNan;
  EXPECT_FALSE(to_nav_sat_fix(m, kClocks).has_value());
}

TEST(Sensors, IncrementsBecomeRates) {
  ins_t m{};
  m.valid = 1;
  m.interval_us = 10'000;
  m.delta_angle_rad[2] = 0.002;
  m.delta_v_mps[2] = 0.0981;
  auto imu = to_imu(m, kClocks);
  ASSERT_TRUE(imu.has_value());
  EXPECT_NEAR(imu->angular_velocity.z, 0.2, 1e-12);
  EXPECT_NEAR(imu->linear_acceleration.z, 9.81, 1e-9);
  EXPECT_EQ(imu->orientation_covariance[0], -1.0);
  m.interval_us = 0;
  EXPECT_FALSE(to_imu(m, kClocks).has_value());

  odometry_t o{};
  o.speed_mps = -1.5;
  o.sigma_speed_mps = 0.1;
  o.yaw_rate_radps = kNan;
  const auto twist = to_twist(o, kClocks);
  EXPECT_EQ(twist->twist.twist.linear.x, -1.5);
  EXPECT_NEAR(twist->twist.covariance[0], 0.01, 1e-12);
  EXPECT_EQ(twist->twist.twist.angular.z, 0.0);
  EXPECT_EQ(twist->twist.covariance[35], kUnknownVariance);
}

map_patch_t patch() {
  map_patch_t m{};
  m.cell_m = 0.5;
  m.first_i = -2;
  m.first_j = 4;
  m.width = 3;   // x
  m.height = 2;  // y
  m.base_m = 100.0;
  m.n = 6;
  m.height_cm = {0, 10, 20, 30, 40, -32768};
  m.step_cm.assign(6, 5);
  m.slope_deg.assign(6, 90);
  m.roughness_cm.assign(6, 2);
  m.flags = {0, map_patch_t::FLAG_OBSTACLE, 0, 0, 0, map_patch_t::FLAG_UNKNOWN};
  return m;
}

TEST(Terrain, CellsKeepTheirPlaces) {
  const auto grid = to_occupancy(patch(), kClocks);
  ASSERT_TRUE(grid.has_value());
  EXPECT_EQ(grid->info.origin.position.x, -1.0);
  EXPECT_EQ(grid->info.origin.position.y, 2.0);
  EXPECT_THAT(grid->data, ElementsAre(0, 100, 0, 0, 0, -1));
  const auto map = to_grid_map(patch(), kClocks);
  ASSERT_TRUE(map.has_value());
  EXPECT_EQ(map->info.pose.position.x, -0.25);
  EXPECT_EQ(map->info.pose.position.y, 2.5);
  EXPECT_EQ(map->info.length_x, 1.5);
  EXPECT_THAT(map->layers, ElementsAre("elevation", "step", "slope", "roughness", "obstacle"));
  const std::vector<float>& z = map->data[0].data;
  // By columns from the largest y, in each from the largest x.
  EXPECT_TRUE(std::isnan(z[0]));
  EXPECT_THAT(std::vector<float>(z.begin() + 1, z.end()),
              ElementsAre(100.4F, 100.3F, 100.2F, 100.1F, 100.0F));
  EXPECT_NEAR(map->data[2].data[1], kPi / 2.0, 1e-6);
  EXPECT_EQ(map->data[4].data[4], 1.0F);
}

TEST(Terrain, ContradictorySizesAreRejected) {
  map_patch_t m = patch();
  m.width = 4;
  EXPECT_FALSE(to_occupancy(m, kClocks).has_value());
  m = patch();
  m.flags.pop_back();
  EXPECT_FALSE(to_grid_map(m, kClocks).has_value());
  m = patch();
  m.width = m.height = 1 << 30;
  EXPECT_FALSE(to_grid_map(m, kClocks).has_value());
}

ladar_points_t facet(std::int64_t scan, int number, int count, std::int64_t utime) {
  ladar_points_t m{};
  m.scan_id = scan;
  m.facet = static_cast<std::int16_t>(number);
  m.facet_count = static_cast<std::int16_t>(count);
  m.utime = utime;
  m.reference_utime = 500'000;
  m.n = m.n_index = m.n_time = 1;
  m.x_m = {static_cast<float>(number)};
  m.y_m = {2.0F};
  m.z_m = {3.0F};
  m.row = {static_cast<std::int16_t>(7 + number)};
  m.col = {0};
  m.dt_us = {10};
  return m;
}

template <class T>
T at(const msg::PointCloud2& cloud, std::size_t point, std::size_t field) {
  return wire::take<T>(cloud.data.data() + point * cloud.point_step +
                       cloud.point_fields[field].offset);
}

TEST(PointClouds, FacetsOfAScanAreJoined) {
  CloudJoiner joiner("ladar");
  const ClockOffsets none;
  EXPECT_FALSE(joiner.add(*to_cloud_part(facet(1, 1, 2, 400'100)), none).has_value());
  EXPECT_FALSE(joiner.completed(none).has_value());
  (void)joiner.add(*to_cloud_part(facet(1, 1, 2, 400'100)), none);  // repeated
  EXPECT_FALSE(joiner.completed(none).has_value());
  (void)joiner.add(*to_cloud_part(facet(1, 0, 2, 400'000)), none);
  const auto cloud = joiner.completed(none);
  ASSERT_TRUE(cloud.has_value());
  EXPECT_EQ(cloud->width, 2U);
  EXPECT_EQ(cloud->header.stamp.nanosec, 400'010'000U) << "of the first point";
  ASSERT_EQ(cloud->point_fields.size(), 5U);
  EXPECT_EQ(cloud->point_fields[3].name, "t");
  EXPECT_EQ(cloud->point_fields[4].name, "ring");
  EXPECT_EQ(at<float>(*cloud, 0, 0), 1.0F);
  EXPECT_EQ(at<std::uint32_t>(*cloud, 0, 3), 100'000U);
  EXPECT_EQ(at<std::uint32_t>(*cloud, 1, 3), 0U);
  EXPECT_EQ(at<std::uint16_t>(*cloud, 0, 4), 8U);
  EXPECT_FALSE(joiner.finish(none).has_value());
}

TEST(PointClouds, AnIncompleteScanEndsWithTheNextOne) {
  CloudJoiner joiner("ladar");
  const ClockOffsets none;
  (void)joiner.add(*to_cloud_part(facet(1, 0, 3, 0)), none);
  const auto first = joiner.add(*to_cloud_part(facet(2, 0, 3, 0)), none);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->width, 1U);
  EXPECT_TRUE(joiner.finish(none).has_value());
  EXPECT_FALSE(to_cloud_part(facet(1, 3, 3, 0)).has_value()) << "an invalid number";
  ladar_points_t m = facet(1, 0, 1, 0);
  m.y_m = {std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(to_cloud_part(m)->x_m.size(), 0U);
  m = facet(1, 0, 1, 0);
  m.row.clear();
  EXPECT_FALSE(to_cloud_part(m).has_value()) << "arrays of different lengths";
}

TEST(PointClouds, WithoutTimesTheStampIsTheReference) {
  ladar_points_t m = facet(1, 0, 1, 400'000);
  m.n_time = m.n_index = 0;
  m.dt_us.clear();
  m.row.clear();
  m.col.clear();
  CloudJoiner joiner("ladar");
  (void)joiner.add(*to_cloud_part(m), {});
  const auto cloud = joiner.completed({});
  EXPECT_EQ(cloud->header.stamp.nanosec, 500'000'000U);
  EXPECT_EQ(cloud->point_fields.size(), 3U);
  EXPECT_EQ(cloud->point_step, 12U);
}

TEST(Status, EventsAndAccounts) {
  event_t e{};
  e.node = "wm";
  e.code = "fde";
  e.text = "GPS excluded";
  e.severity = event_t::SEVERITY_WARNING;
  e.utime = 1'000'000;
  const msg::Log log = to_log(e, kClocks);
  EXPECT_EQ(log.level, 30);
  EXPECT_EQ(log.stamp.sec, 3) << "node time";
  EXPECT_EQ(log.msg, "fde: GPS excluded");
  cycle_t c{};
  c.node = "sp";
  EXPECT_EQ(to_diagnostics(c, kClocks).status[0].level, msg::Byte{0});
  c.slack_us = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(to_diagnostics(c, kClocks).status[0].level, msg::Byte{1});
  process_t p{};
  p.note = "memory is not locked";
  EXPECT_EQ(to_diagnostics(p, kClocks).status[0].message, "memory is not locked");
}

TEST(Converter, PublishesOriginalAndStandardTopics) {
  class Sink final : public TopicSink {
   public:
    void publish(std::string_view topic, const Schema& schema,
                 const std::vector<std::uint8_t>& /*cdr*/) override {
      types[std::string(topic)] = schema.name;
    }
    std::map<std::string, std::string> types;
  };
  Sink sink;
  Converter converter({}, &sink);
  const nav_state_t m = nav_state();
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, m.getEncodedSize());
  EXPECT_EQ(converter.convert("WM_NAV_STATE", bytes.data(), bytes.size()), Conversion::kDone);
  EXPECT_THAT(
      sink.types,
      ElementsAre(testing::Pair("/rcs/WM_NAV_STATE", "rcs_msgs/msg/NavState"),
                  testing::Pair("/tf", "tf2_msgs/msg/TFMessage"),
                  testing::Pair("/wm/odometry", "nav_msgs/msg/Odometry"),
                  testing::Pair("/wm/pose", "geometry_msgs/msg/PoseWithCovarianceStamped")));
  EXPECT_EQ(converter.convert("INS", bytes.data(), bytes.size()), Conversion::kMalformed);
  EXPECT_EQ(converter.convert("CAMERA", bytes.data(), bytes.size()), Conversion::kUnknownChannel);
}

}  // namespace
}  // namespace rcs::ros2
