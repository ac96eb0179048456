#pragma once
// Emergency stop of BG: updates the latch from the decision, and the status from the result.

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

  /// Once a cycle: after the drive command is published, because disk access takes time, and before
  /// the status, so that an echo without an error confirms a stop that outlives BG.
  /// @param command   in force; null: none
  /// @param is_new    it was accepted in this cycle
  /// @param decision  its status and reason report failures; a release that failed is reverted
  /// @return released in this cycle
  bool update(const command_t* command, bool is_new, Stamp now, Report* report, Decision* decision);

 private:
  void report_start(Stamp now, Report* report);
  void keep(Stamp now, Report* report, Decision* decision);

  StopLatch latch_;
  bool started_ = false;
  Stamp next_try_ = Stamp::min();  // next attempt to write the file
  std::string trouble_;            // error of the newest attempt
  std::string reason_;             // referenced by Decision::reason
};

}  // namespace rcs::bg
