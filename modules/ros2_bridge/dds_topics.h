#pragma once
// The topics of both directions, and a received sample.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rcs::ros2_bridge {

struct DdsOutput {
  std::string topic;  ///< of ROS 2: "/tf"
  std::string type;   ///< "tf2_msgs/TFMessage"
  bool kept = false;  ///< late subscribers receive the newest messages (transient local)
};

struct DdsInput {
  std::string topic;
  std::string type;
  int depth = 1;  ///< messages that wait at most; the oldest are dropped
};

struct DdsSample {
  const std::uint8_t* data = nullptr;  ///< with the header of CDR; valid during the call
  std::size_t size = 0;
  std::uint64_t publisher = 0;  ///< handle of the writer
};

}  // namespace rcs::ros2_bridge
