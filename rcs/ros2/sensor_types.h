#pragma once
// Types of ROS 2 (sensor_msgs) that the mappings use; see basic_types.h.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/ros2/basic_types.h"

namespace rcs::ros2::msg {

struct PointField {
  static constexpr char kName[] = "sensor_msgs/PointField";
  std::string name;
  std::uint32_t offset = 0;   ///< in a point [bytes]
  std::uint8_t datatype = 0;  ///< kInt8 = 1 ... kFloat64 = 8
  std::uint32_t count = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("name", m.name);
    visit("offset", m.offset);
    visit("datatype", m.datatype);
    visit("count", m.count);
  }
};

struct PointCloud2 {
  static constexpr char kName[] = "sensor_msgs/PointCloud2";
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> point_fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("height", m.height);
    visit("width", m.width);
    visit("fields", m.point_fields);
    visit("is_bigendian", m.is_bigendian);
    visit("point_step", m.point_step);
    visit("row_step", m.row_step);
    visit("data", m.data);
    visit("is_dense", m.is_dense);
  }
};

struct Imu {
  static constexpr char kName[] = "sensor_msgs/Imu";
  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{};          ///< [0] = -1: no orientation
  Vector3 angular_velocity;                                ///< [rad/s]
  std::array<double, 9> angular_velocity_covariance{};     ///< zeros: unknown
  Vector3 linear_acceleration;                             ///< specific force [m/s^2]
  std::array<double, 9> linear_acceleration_covariance{};  ///< zeros: unknown
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("orientation", m.orientation);
    visit("orientation_covariance", m.orientation_covariance);
    visit("angular_velocity", m.angular_velocity);
    visit("angular_velocity_covariance", m.angular_velocity_covariance);
    visit("linear_acceleration", m.linear_acceleration);
    visit("linear_acceleration_covariance", m.linear_acceleration_covariance);
  }
};

struct NavSatStatus {
  static constexpr char kName[] = "sensor_msgs/NavSatStatus";
  std::int8_t status = 0;     ///< -1 no fix, 0 fix, 1 SBAS, 2 GBAS
  std::uint16_t service = 0;  ///< bits; 1: GPS
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("status", m.status);
    visit("service", m.service);
  }
};

struct NavSatFix {
  static constexpr char kName[] = "sensor_msgs/NavSatFix";
  Header header;
  NavSatStatus status;
  double latitude = 0.0;                        ///< [deg]
  double longitude = 0.0;                       ///< [deg]
  double altitude = 0.0;                        ///< above the ellipsoid [m]; NaN: unknown
  std::array<double, 9> position_covariance{};  ///< east, north, up [m^2]
  std::uint8_t position_covariance_type = 0;    ///< 0 unknown, 2 diagonal
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("status", m.status);
    visit("latitude", m.latitude);
    visit("longitude", m.longitude);
    visit("altitude", m.altitude);
    visit("position_covariance", m.position_covariance);
    visit("position_covariance_type", m.position_covariance_type);
  }
};

struct CompressedImage {
  static constexpr char kName[] = "sensor_msgs/CompressedImage";
  Header header;
  std::string format;
  std::vector<std::uint8_t> data;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("format", m.format);
    visit("data", m.data);
  }
};

}  // namespace rcs::ros2::msg
