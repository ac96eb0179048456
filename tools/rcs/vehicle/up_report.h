#pragma once
// Messages of `rcs up`: UP_PROCESS once per second, whose note names the failing nodes, and
// UP_EVENT when a node begins to fail or has recovered, and when the recorder ends.

#include <cstdint>
#include <string>
#include <string_view>

#include "lcmtypes/events.h"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/process/process.h"
#include "rcs/node/report.h"

namespace rcs::cli {

class UpReport {
 public:
  UpReport(Bus* bus, const std::string& config, std::int64_t config_hash, Stamp now);

  /// Time at which process() is due; it may be called earlier.
  [[nodiscard]] Stamp next() const { return next_; }
  /// @param note  about the failing nodes; empty: none
  /// @return it was published
  bool process(Stamp now, const std::string& note);
  void failing(Stamp now, std::string_view what) {
    events_.publish(now, event::kUpNodeFailing, "{}", what);
  }
  void recovered(Stamp now, std::string_view node) {
    events_.publish(now, event::kUpNodeRecovered, "{} runs again", node);
  }
  void recorder_ended(Stamp now, std::string_view how) {
    events_.publish(now, event::kUpRecorderEnded,
                    "the recorder {}: messages are not recorded until it runs again", how);
  }

 private:
  Report events_;
  Outbox<process_t> outbox_;
  ProcessUsage usage_;
  process_t message_{};
  Stamp next_;
};

}  // namespace rcs::cli
