#pragma once
// An LCM log as an MCAP file with messages of ROS 2.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/sp/scan/range_image.h"
#include "rcs/base/result.h"
#include "rcs/node/log/log_file.h"
#include "rcs/ros2/converter.h"
#include "tools/mcap/mcap_writer.h"

namespace rcs::mcap {

/// Keys of the metadata of a channel that carries one of our own types.
inline constexpr char kLcmChannel[] = "lcm_channel";
inline constexpr char kLcmFingerprint[] = "lcm_fingerprint";  ///< of the type, hexadecimal
/// Name of the metadata record of the file, and its keys.
inline constexpr char kClockRecord[] = "rcs_clocks";
inline constexpr char kSensorOffset[] = "utc_minus_sensor_time_us";
inline constexpr char kNodeOffset[] = "utc_minus_node_time_us";

/// The fingerprint of the type of a channel, 16 hexadecimal digits; empty: an unknown channel.
[[nodiscard]] std::string fingerprint_of(std::string_view channel);

struct ExportOptions {
  bool standard = true;  ///< topics with types of ROS 2
  bool original = true;  ///< /rcs/CHANNEL with our own types, which import_log() reads again
  std::optional<sp::LadarParams> ladar;  ///< for points of LADAR_RANGES, and the mount in /tf
  ros2::ClockOffsets clocks;
  WriterOptions writer;
};

struct ExportCounts {
  std::int64_t events = 0;                        ///< of the log
  std::map<std::string, std::int64_t> malformed;  ///< not of the type of their channel
  std::map<std::string, std::int64_t> unknown;    ///< channels that are not of this system
  std::int64_t ranges_without_calibration = 0;    ///< facets without points
};

struct ExportedTopic {
  std::string topic;
  std::string type;
  std::uint64_t messages = 0;
};

/// Converts the events of a log in their order.
class LogExport final : private ros2::TopicSink {
 public:
  /// @param sink  outlives the export
  LogExport(const ExportOptions& options, ByteSink* sink);

  /// @return the first failure of the sink
  const Outcome& add(const LogEvent& event);
  Outcome finish();

  [[nodiscard]] const ExportCounts& counts() const { return counts_; }
  [[nodiscard]] std::vector<ExportedTopic> topics() const;  ///< by name
  [[nodiscard]] std::uint64_t bytes() const { return writer_.bytes(); }
  [[nodiscard]] std::uint64_t messages() const { return writer_.messages(); }

 private:
  struct Stream {
    std::uint16_t id = 0;
    std::string type;
  };

  void publish(std::string_view topic, const ros2::Schema& schema,
               const std::vector<std::uint8_t>& cdr) override;
  Stream open(const std::string& topic, const ros2::Schema& schema);

  Writer writer_;
  ros2::Converter converter_;
  bool has_ladar_;
  ExportCounts counts_;
  std::uint64_t time_ns_ = 0;                                  // of the current event
  std::map<std::string, Stream, std::less<>> streams_;         // by topic
  std::map<std::string, std::uint16_t, std::less<>> schemas_;  // by name
};

}  // namespace rcs::mcap
