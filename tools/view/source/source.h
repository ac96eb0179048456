#pragma once
// Where the messages come from: a bus or a log.

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/ros2/frames.h"
#include "tools/view/server/topic_table.h"
#include "tools/view/source/scan_pair.h"

namespace rcs::view {

/// One message with its times.
struct SourceMessage {
  std::string_view channel;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
  Duration time{};               ///< of a log: after its begin; live: after the start of the viewer
  std::int64_t stamp_utime = 0;  ///< wall clock of the recording or of the receipt
};

/// Receives what a source shows.
class SourceSink {
 public:
  virtual void on_message(const SourceMessage& message) = 0;
  /// The moment that is shown jumped: earlier messages do not describe it.
  virtual void on_jump() = 0;
  /// The source changed its state: playing, speed, time.
  virtual void on_state() = 0;
  /// Nothing more can be received.
  virtual void on_failure(const std::string& reason) = 0;

 protected:
  ~SourceSink() = default;
};

class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  [[nodiscard]] virtual bool live() const = 0;
  [[nodiscard]] virtual std::string name() const = 0;  ///< the path of a log, the address of a bus
  [[nodiscard]] virtual ChannelSet channels() const = 0;
  [[nodiscard]] virtual ros2::ClockOffsets clocks() const = 0;
  [[nodiscard]] virtual Duration time() const = 0;
  [[nodiscard]] virtual std::int64_t begin_utime() const = 0;  ///< wall clock at time 0
  [[nodiscard]] virtual Duration duration() const = 0;         ///< of a log; live: time()
  [[nodiscard]] virtual bool playing() const = 0;
  [[nodiscard]] virtual double speed() const = 0;

  /// Of a log; on a bus they do nothing.
  virtual void play() {}
  virtual void pause() {}
  virtual void seek(Duration /*time*/) {}
  virtual void set_speed(double /*speed*/) {}
  /// Of a log: passes the messages that describe the present moment. On a bus: none.
  virtual void state(ChannelSet /*channels*/,
                     const std::function<void(const SourceMessage&)>& /*visit*/) {}
  /// Of a log: the explanation of a moment (`rcs why`). On a bus: null.
  [[nodiscard]] virtual nlohmann::ordered_json explain(Duration /*time*/) { return nullptr; }
  /// Of a log: the scans before a moment, see placed_scans(). On a bus: empty.
  [[nodiscard]] virtual std::string recent_scans(Duration /*time*/) { return {}; }

  /// Of a log: see scan_pair(). On a bus: an error.
  [[nodiscard]] virtual Result<nlohmann::ordered_json> pair(const ScanPairRequest& /*request*/) {
    return Error{"pairs are computed from a log, not from a bus"};
  }

  /// Begins to pass messages to the sink, which outlives the source.
  virtual void start(SourceSink* sink) = 0;
};

}  // namespace rcs::view
