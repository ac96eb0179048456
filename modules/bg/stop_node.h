#pragma once
// Emergency stop of BG: updates the latch from the stops that arrive and from the decision, and the
// status from the result.

#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "modules/bg/decide.h"
#include "rcs/node/command_port.h"
#include "rcs/node/report.h"
#include "rcs/node/stop_latch.h"

namespace rcs::bg {

class EmergencyStop {
 public:
  /// @param authorities  issuers that may release the stops of others
  EmergencyStop(StopLatch latch, std::vector<std::string> authorities)
      : latch_(std::move(latch)), authorities_(std::move(authorities)) {}

  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;
  ~EmergencyStop() { latch_.finish(); }

  [[nodiscard]] bool engaged() const { return latch_.engaged(); }
  /// A release was accepted, and the file of the latch is being removed.
  [[nodiscard]] bool releasing() const { return latch_.releasing(); }

  /// Once a cycle, before the decision: the stops are in force from now on.
  void engage(const std::vector<stop_t>& stops, Stamp now, Report* report);

  /// Once a cycle: after the drive command is published, and before the status.
  /// @param command   in force; null: none
  /// @param decision  its status and reason report failures and releases
  void update(const command_t* command, Stamp now, Report* report, Decision* decision);

  /// The latch in the status.
  void describe(StatusReport* status) const;
  /// Ids of the stops that were released since the last call.
  [[nodiscard]] std::vector<std::int64_t> take_released() { return latch_.take_released(); }

 private:
  void release(const command_t& command, Decision* decision);
  void take_step(const StopLatch::Step& step, Stamp now, Report* report, Decision* decision);
  void describe_state(const command_t* command, Decision* decision);

  StopLatch latch_;
  std::vector<std::string> authorities_;
  bool started_ = false;
  std::string cause_;         // before the step
  std::string trouble_;       // of the newest attempt to write the file; empty: none
  std::string not_released_;  // why the release in force has failed; empty: it has not
  std::string reason_;        // referenced by Decision::reason
};

}  // namespace rcs::bg
