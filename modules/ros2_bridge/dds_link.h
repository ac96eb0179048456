#pragma once
// The DDS side of the bridge: one participant in the domain of ROS 2, without security. Samples are
// XCDR1 (rcs/cdr) in both directions. No call on an open link blocks.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "modules/ros2_bridge/dds_topics.h"
#include "rcs/base/result.h"
#include "rcs/dds/entity.h"
#include "rcs/dds/network.h"

namespace rcs::ros2_bridge {

class DdsLink {
 public:
  static constexpr std::size_t kMaxSamples = 64;  ///< taken from an input in one call

  /// @param max_sample_bytes  larger samples are not assembled and are lost unseen
  static Result<std::unique_ptr<DdsLink>> open(const dds::Network& network,
                                               const std::vector<DdsOutput>& outputs,
                                               const std::vector<DdsInput>& inputs,
                                               std::size_t max_sample_bytes);

  /// @param output  index in the list of open()
  /// @param cdr     a payload of the type of the output
  /// @return false: rejected by DDS, e.g. because a reader is too slow
  bool write(std::size_t output, const std::vector<std::uint8_t>& cdr);

  /// Takes the waiting samples of an input, the oldest first, at most kMaxSamples.
  void take(std::size_t input, const std::function<void(const DdsSample&)>& receive);

 private:
  struct Writer {
    dds::Entity entity;
    const dds_topic_descriptor_t* type = nullptr;
  };

  DdsLink() = default;
  Outcome add(const DdsOutput& output);
  Outcome add(const DdsInput& input);
  [[nodiscard]] Result<dds_entity_t> make_topic(const std::string& topic,
                                                const dds_topic_descriptor_t* type);

  // In order of creation; released in reverse order.
  dds::Entity domain_;
  dds::Entity participant_;
  std::vector<Writer> writers_;
  std::vector<dds::Entity> readers_;
  std::vector<std::uint64_t> sample_;  // memory of the sample that is written
};

/// "rt/tf" of "/tf": the name of a topic of ROS 2 in DDS.
[[nodiscard]] std::string dds_topic_name(std::string_view topic);

}  // namespace rcs::ros2_bridge
