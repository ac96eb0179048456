// Bridge to ROS 2: publishes topics that ROS 2 nodes read, and receives sensors from them, by DDS.

#include "modules/ros2_bridge/ros2_bridge_node.h"
#include "rcs/node/process/node_main.h"

int main(int argc, char** argv) {
  return rcs::node_main(argc, argv, "ros2_bridge", rcs::ros2_bridge::make_ros2_bridge_node);
}
