// Writes the IDL of the types of ROS 2 that the bridge publishes and receives, for idlc, and the
// list of the descriptors that idlc makes of it: ros2_bridge_idl OUT.idl OUT.inc

#include <fstream>
#include <string>
#include <type_traits>
#include <vector>

#include "rcs/ros2/converter.h"
#include "rcs/ros2/schema.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::vector<rcs::ros2::TypeDescription> types;
  // The types of the inputs are among those of the topics.
  rcs::ros2::for_each_topic([&](const auto& topic) {
    rcs::ros2::describe<typename std::decay_t<decltype(topic)>::Message>(&types);
  });
  std::ofstream idl(argv[1]);
  idl << rcs::ros2::idl_text(types);
  std::ofstream list(argv[2]);
  list << rcs::ros2::descriptor_list(types);
  return idl.flush() && list.flush() ? 0 : 3;
}
