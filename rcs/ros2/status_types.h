#pragma once
// Types of ROS 2 (visualization_msgs, rcl_interfaces, diagnostic_msgs) that the mappings use; see
// basic_types.h.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/ros2/basic_types.h"
#include "rcs/ros2/sensor_types.h"

namespace rcs::ros2::msg {

struct UvCoordinate {
  static constexpr char kName[] = "visualization_msgs/UVCoordinate";
  float u = 0.0F;
  float v = 0.0F;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("u", m.u);
    visit("v", m.v);
  }
};

struct MeshFile {
  static constexpr char kName[] = "visualization_msgs/MeshFile";
  std::string filename;
  std::vector<std::uint8_t> data;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("filename", m.filename);
    visit("data", m.data);
  }
};

struct Marker {
  static constexpr char kName[] = "visualization_msgs/Marker";
  Header header;
  std::string ns;
  std::int32_t id = 0;
  std::int32_t type = 0;    ///< 3: cylinder
  std::int32_t action = 0;  ///< 0: add or modify, 2: delete
  Pose pose;
  Vector3 scale;  ///< [m]
  ColorRgba color;
  Duration lifetime;  ///< 0: for ever
  bool frame_locked = false;
  std::vector<Point> points;
  std::vector<ColorRgba> colors;
  std::string texture_resource;
  CompressedImage texture;
  std::vector<UvCoordinate> uv_coordinates;
  std::string text;
  std::string mesh_resource;
  MeshFile mesh_file;
  bool mesh_use_embedded_materials = false;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("ns", m.ns);
    visit("id", m.id);
    visit("type", m.type);
    visit("action", m.action);
    visit("pose", m.pose);
    visit("scale", m.scale);
    visit("color", m.color);
    visit("lifetime", m.lifetime);
    visit("frame_locked", m.frame_locked);
    visit("points", m.points);
    visit("colors", m.colors);
    visit("texture_resource", m.texture_resource);
    visit("texture", m.texture);
    visit("uv_coordinates", m.uv_coordinates);
    visit("text", m.text);
    visit("mesh_resource", m.mesh_resource);
    visit("mesh_file", m.mesh_file);
    visit("mesh_use_embedded_materials", m.mesh_use_embedded_materials);
  }
};

struct MarkerArray {
  static constexpr char kName[] = "visualization_msgs/MarkerArray";
  std::vector<Marker> markers;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("markers", m.markers);
  }
};

struct Log {
  static constexpr char kName[] = "rcl_interfaces/Log";
  Time stamp;
  std::uint8_t level = 0;  ///< 20 info, 30 warning, 40 error
  std::string name;
  std::string msg;
  std::string file;
  std::string function;
  std::uint32_t line = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("stamp", m.stamp);
    visit("level", m.level);
    visit("name", m.name);
    visit("msg", m.msg);
    visit("file", m.file);
    visit("function", m.function);
    visit("line", m.line);
  }
};

struct KeyValue {
  static constexpr char kName[] = "diagnostic_msgs/KeyValue";
  std::string key;
  std::string value;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("key", m.key);
    visit("value", m.value);
  }
};

struct DiagnosticStatus {
  static constexpr char kName[] = "diagnostic_msgs/DiagnosticStatus";
  Byte level{};  ///< 0 ok, 1 warning, 2 error, 3 stale
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("level", m.level);
    visit("name", m.name);
    visit("message", m.message);
    visit("hardware_id", m.hardware_id);
    visit("values", m.values);
  }
};

struct DiagnosticArray {
  static constexpr char kName[] = "diagnostic_msgs/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("status", m.status);
  }
};

}  // namespace rcs::ros2::msg
