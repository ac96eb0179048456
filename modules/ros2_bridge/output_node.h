#pragma once
// From the bus to ROS 2: receives the channels of the selected topics, converts their messages
// (rcs/ros2/converter.h), and writes what the rates and the byte budget permit.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/ros2_bridge/output_budget.h"
#include "modules/ros2_bridge/ros2_bridge_config.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/channel_owner.h"
#include "rcs/node/report.h"
#include "rcs/ros2/clock_estimate.h"
#include "rcs/ros2/converter.h"

namespace rcs::ros2_bridge {

/// Channels of which a topic is made: "*_CYCLE, INS" names the channels that end in _CYCLE, and
/// INS.
[[nodiscard]] std::vector<std::string> channels_of(std::string_view from);

/// The topics of the configuration, for DdsLink::open().
[[nodiscard]] std::vector<DdsOutput> outputs_of(const OutputConfig& config);

class BusToRos2 final : private ros2::TopicSink {
 public:
  /// Writes a payload to the output with this index; false: rejected.
  using Write = std::function<bool(std::size_t output, const std::vector<std::uint8_t>& cdr)>;

  struct Counts {
    std::int64_t written = 0;
    std::int64_t decimated = 0;    ///< above the rate of the topic
    std::int64_t over_budget = 0;  ///< the byte budget was exhausted
    std::int64_t too_large = 0;    ///< for the byte budget
    std::int64_t waiting = 0;      ///< too many messages of the bus waited
    std::int64_t malformed = 0;    ///< not of the type of the channel, or of another publisher
    std::int64_t dds_failures = 0;
  };

  BusToRos2(const Ros2BridgeConfig& config, Bus* bus, Write write);

  /// Publishes the messages that wait.
  /// @param utc_minus_node_us  see UtcOffset
  void run(std::int64_t utc_minus_node_us, Stamp now, Report* report);
  /// UTC stepped: the offset of the clock of the sensors is measured again.
  void restart_clock() { measured_ = {}; }

  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kMaxWaiting = 512;  ///< 4 scans of 117,000 points

  struct Waiting {
    std::string_view channel;
    std::vector<std::uint8_t> bytes;
  };
  /// Receives one channel.
  class Source final : public Receiver {
   public:
    Source(BusToRos2* parent, std::string channel, std::int64_t run_id, bool published);
    void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override;

   private:
    BusToRos2* parent_;
    std::string channel_;
    ChannelOwner owner_;
    bool published_;  // else only its times are read
  };
  struct Output {
    std::string topic;
    Decimator decimator;
  };

  void publish(std::string_view topic, const ros2::Schema& schema,
               const std::vector<std::uint8_t>& cdr) override;
  void push(std::string_view channel, const std::uint8_t* data, std::size_t size);
  [[nodiscard]] bool has_clock(std::string_view channel) const;
  [[nodiscard]] ros2::ClockOffsets clocks(std::int64_t utc_minus_node_us) const;
  void report_losses(Stamp now, Report* report);

  SensorClock sensor_clock_;
  Write write_;
  ByteBudget budget_;
  ros2::Converter converter_;
  ros2::ClockEstimate measured_;  // of sensor time against node time
  std::vector<Output> outputs_;
  std::deque<Source> sources_;
  std::vector<Waiting> waiting_;  // slots in use: the first used_
  std::size_t used_ = 0;
  Stamp now_;
  Counts counts_;
  Counts reported_;
};

}  // namespace rcs::ros2_bridge
