#pragma once
// Messages of the recorder: RECORD_PROCESS once per second, and RECORD_EVENT with the same texts as
// on the terminal when messages are lost, segments are deleted early, or the recording stops.

#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/process/process.h"
#include "rcs/node/report.h"
#include "tools/recorder/recorder_thread.h"

namespace rcs::recorder {

/// Name of the process in channels and in `rcs top`.
inline constexpr std::string_view kNodeName = "record";

class RecorderReport {
 public:
  /// @param folder  of the recording
  RecorderReport(Bus* bus, const RecorderParams& params, const std::string& folder, Stamp now);

  /// Time at which update() is due.
  [[nodiscard]] Stamp next() const { return next_; }
  /// Publishes what has changed since the last call.
  /// @return the texts of the events
  std::vector<std::string> update(Stamp now, const RecorderThread::State& state);

 private:
  static constexpr Duration kPeriod = std::chrono::seconds(1);
  /// Between two reports of the same losses; a stop and its end are reported at once.
  static constexpr Duration kLossInterval = std::chrono::seconds(5);

  void report_stop(Stamp now, const RecorderStatus& status);
  void report_losses(Stamp now, const RecorderThread::State& state);
  template <class... Args>
  void publish(Stamp now, const event::Info& event, fmt::format_string<Args...> text,
               const Args&... args);

  Report events_;
  Outbox<process_t> outbox_;
  ProcessUsage usage_;
  process_t message_{};
  double reserve_mb_;
  Stamp next_;
  Stamp losses_due_ = Stamp::min();
  Duration exposure_{};  // largest since it was reported
  std::int64_t cycles_ = 0;
  Stamp progress_;  // when `cycles_` changed
  int stopped_by_ = 0;
  std::int64_t lost_ = 0;  // messages, until the last update
  RecorderThread::State reported_;
  std::vector<std::string> texts_;
};

}  // namespace rcs::recorder
