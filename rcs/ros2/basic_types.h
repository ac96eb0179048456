#pragma once
// Types of ROS 2 (builtin_interfaces, std_msgs, geometry_msgs) that the mappings use. Each struct
// is the only description of its type: bytes (rcs/cdr), schema text and IDL (schema.h) derive from
// kName and fields(). Definitions: github.com/ros2/rcl_interfaces and ros2/common_interfaces.

#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace rcs::ros2::msg {

/// Type `byte` of ROS 2: 8 bits without a sign, that are not a number.
enum class Byte : std::uint8_t {};

template <class T, class = void>
struct HasFields : std::false_type {};
template <class T>
struct HasFields<T, std::void_t<decltype(T::kName)>> : std::true_type {};

/// Calls visit("name", m.name) for each field; see rcs/cdr/cdr_message.h.
template <class M, class Visit, std::enable_if_t<HasFields<std::remove_const_t<M>>::value, int> = 0>
void for_each_field(M& m, Visit&& visit) {
  std::remove_const_t<M>::fields(m, visit);
}

struct Time {
  static constexpr char kName[] = "builtin_interfaces/Time";
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("sec", m.sec);
    visit("nanosec", m.nanosec);
  }
};

struct Duration {
  static constexpr char kName[] = "builtin_interfaces/Duration";
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("sec", m.sec);
    visit("nanosec", m.nanosec);
  }
};

struct Header {
  static constexpr char kName[] = "std_msgs/Header";
  Time stamp;
  std::string frame_id;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("stamp", m.stamp);
    visit("frame_id", m.frame_id);
  }
};

struct ColorRgba {
  static constexpr char kName[] = "std_msgs/ColorRGBA";
  float r = 0.0F;
  float g = 0.0F;
  float b = 0.0F;
  float a = 0.0F;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("r", m.r);
    visit("g", m.g);
    visit("b", m.b);
    visit("a", m.a);
  }
};

struct MultiArrayDimension {
  static constexpr char kName[] = "std_msgs/MultiArrayDimension";
  std::string label;
  std::uint32_t size = 0;
  std::uint32_t stride = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("label", m.label);
    visit("size", m.size);
    visit("stride", m.stride);
  }
};

struct MultiArrayLayout {
  static constexpr char kName[] = "std_msgs/MultiArrayLayout";
  std::vector<MultiArrayDimension> dim;
  std::uint32_t data_offset = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("dim", m.dim);
    visit("data_offset", m.data_offset);
  }
};

struct Float32MultiArray {
  static constexpr char kName[] = "std_msgs/Float32MultiArray";
  MultiArrayLayout layout;
  std::vector<float> data;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("layout", m.layout);
    visit("data", m.data);
  }
};

struct Vector3 {
  static constexpr char kName[] = "geometry_msgs/Vector3";
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("x", m.x);
    visit("y", m.y);
    visit("z", m.z);
  }
};

struct Point {
  static constexpr char kName[] = "geometry_msgs/Point";
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("x", m.x);
    visit("y", m.y);
    visit("z", m.z);
  }
};

struct Quaternion {
  static constexpr char kName[] = "geometry_msgs/Quaternion";
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double w = 1.0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("x", m.x);
    visit("y", m.y);
    visit("z", m.z);
    visit("w", m.w);
  }
};

struct Pose {
  static constexpr char kName[] = "geometry_msgs/Pose";
  Point position;
  Quaternion orientation;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("position", m.position);
    visit("orientation", m.orientation);
  }
};

struct PoseStamped {
  static constexpr char kName[] = "geometry_msgs/PoseStamped";
  Header header;
  Pose pose;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("pose", m.pose);
  }
};

struct PoseWithCovariance {
  static constexpr char kName[] = "geometry_msgs/PoseWithCovariance";
  Pose pose;
  std::array<double, 36>
      covariance{};  ///< 6 x 6 by rows: x, y, z, rotation about the fixed X, Y, Z
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("pose", m.pose);
    visit("covariance", m.covariance);
  }
};

struct PoseWithCovarianceStamped {
  static constexpr char kName[] = "geometry_msgs/PoseWithCovarianceStamped";
  Header header;
  PoseWithCovariance pose;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("pose", m.pose);
  }
};

struct Twist {
  static constexpr char kName[] = "geometry_msgs/Twist";
  Vector3 linear;
  Vector3 angular;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("linear", m.linear);
    visit("angular", m.angular);
  }
};

struct TwistWithCovariance {
  static constexpr char kName[] = "geometry_msgs/TwistWithCovariance";
  Twist twist;
  std::array<double, 36> covariance{};  ///< 6 x 6 by rows, in the axes of the twist
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("twist", m.twist);
    visit("covariance", m.covariance);
  }
};

struct TwistWithCovarianceStamped {
  static constexpr char kName[] = "geometry_msgs/TwistWithCovarianceStamped";
  Header header;
  TwistWithCovariance twist;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("twist", m.twist);
  }
};

struct Transform {
  static constexpr char kName[] = "geometry_msgs/Transform";
  Vector3 translation;
  Quaternion rotation;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("translation", m.translation);
    visit("rotation", m.rotation);
  }
};

struct TransformStamped {
  static constexpr char kName[] = "geometry_msgs/TransformStamped";
  Header header;
  std::string child_frame_id;
  Transform transform;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("child_frame_id", m.child_frame_id);
    visit("transform", m.transform);
  }
};

}  // namespace rcs::ros2::msg
