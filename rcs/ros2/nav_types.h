#pragma once
// Types of ROS 2 (nav_msgs, tf2_msgs, grid_map_msgs) that the mappings use; see basic_types.h.
// grid_map_msgs: github.com/ANYbotics/grid_map, branch ros2.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/ros2/basic_types.h"

namespace rcs::ros2::msg {

struct Odometry {
  static constexpr char kName[] = "nav_msgs/Odometry";
  Header header;
  std::string child_frame_id;
  PoseWithCovariance pose;    ///< in header.frame_id
  TwistWithCovariance twist;  ///< in child_frame_id
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("child_frame_id", m.child_frame_id);
    visit("pose", m.pose);
    visit("twist", m.twist);
  }
};

struct Path {
  static constexpr char kName[] = "nav_msgs/Path";
  Header header;
  std::vector<PoseStamped> poses;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("poses", m.poses);
  }
};

struct MapMetaData {
  static constexpr char kName[] = "nav_msgs/MapMetaData";
  Time map_load_time;
  float resolution = 0.0F;   ///< [m]
  std::uint32_t width = 0;   ///< cells along x
  std::uint32_t height = 0;  ///< cells along y
  Pose origin;               ///< of the corner of cell (0, 0)
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("map_load_time", m.map_load_time);
    visit("resolution", m.resolution);
    visit("width", m.width);
    visit("height", m.height);
    visit("origin", m.origin);
  }
};

struct OccupancyGrid {
  static constexpr char kName[] = "nav_msgs/OccupancyGrid";
  Header header;
  MapMetaData info;
  std::vector<std::int8_t> data;  ///< by rows, x fastest; -1: unknown, else percent
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("info", m.info);
    visit("data", m.data);
  }
};

struct TfMessage {
  static constexpr char kName[] = "tf2_msgs/TFMessage";
  std::vector<TransformStamped> transforms;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("transforms", m.transforms);
  }
};

struct GridMapInfo {
  static constexpr char kName[] = "grid_map_msgs/GridMapInfo";
  double resolution = 0.0;  ///< [m]
  double length_x = 0.0;    ///< [m]
  double length_y = 0.0;    ///< [m]
  Pose pose;                ///< of the centre
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("resolution", m.resolution);
    visit("length_x", m.length_x);
    visit("length_y", m.length_y);
    visit("pose", m.pose);
  }
};

struct GridMap {
  static constexpr char kName[] = "grid_map_msgs/GridMap";
  Header header;
  GridMapInfo info;
  std::vector<std::string> layers;
  std::vector<std::string> basic_layers;  ///< that must be finite for a valid cell
  std::vector<Float32MultiArray> data;    ///< by layers
  std::uint16_t outer_start_index = 0;
  std::uint16_t inner_start_index = 0;
  template <class M, class Visit>
  static void fields(M& m, Visit&& visit) {
    visit("header", m.header);
    visit("info", m.info);
    visit("layers", m.layers);
    visit("basic_layers", m.basic_layers);
    visit("data", m.data);
    visit("outer_start_index", m.outer_start_index);
    visit("inner_start_index", m.inner_start_index);
  }
};

}  // namespace rcs::ros2::msg
