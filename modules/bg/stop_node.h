#pragma once
// BG's emergency stop: brings the latch to what was decided, and the status to what became of it.

#include <string>
#include <utility>

#include "modules/bg/decide.h"
#include "rcs/node/report.h"
#include "rcs/node/stop_latch.h"

namespace rcs::bg {

class EmergencyStop {
 public:
  explicit EmergencyStop(StopLatch latch) : latch_(std::move(latch)) {}

  [[nodiscard]] bool engaged() const { return latch_.engaged(); }
  [[nodiscard]] bool persisted() const { return latch_.persisted(); }

  /// Once a cycle, after the drive command has been published, as a disk takes its time, and before
  /// the status: an echo without an error reports a stop that outlives BG.
  /// @param command   that is in force; null: none
  /// @param is_new    it was accepted in this cycle
  /// @param decision  its status and reason report what failed; a release that failed is undone
  /// @return released in this cycle
  bool update(const command_t* command, bool is_new, Stamp now, Report* report, Decision* decision);

 private:
  void report_start(Stamp now, Report* report);
  void keep(Stamp now, Report* report, Decision* decision);

  StopLatch latch_;
  bool started_ = false;
  Stamp next_try_ = Stamp::min();  // to write the file
  std::string trouble_;            // of the newest try
  std::string reason_;             // Decision::reason points to it
};

}  // namespace rcs::bg
