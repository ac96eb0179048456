#pragma once
// What BG receives besides commands, and who else publishes there.

#include <optional>
#include <vector>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "modules/bg/bg_messages_node.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/report.h"

namespace rcs::bg {

class BgInputs {
 public:
  /// @param supervised  `rcs up` has started this process
  BgInputs(Bus* bus, bool supervised);

  [[nodiscard]] std::vector<const InboxBase*> inboxes() const;
  /// Once a cycle: the supervisor, what is published on BG's own channel, and the integrity.
  void take(Stamp now, Report* report);

  [[nodiscard]] Inbox<nav_state_t>& nav_states() { return nav_states_; }
  [[nodiscard]] Inbox<map_patch_t>& map_patches() { return map_patches_; }
  /// The newest valid one.
  [[nodiscard]] const Integrity& integrity() const { return integrity_; }

  [[nodiscard]] bool supervisor_silent(Stamp now) const;
  /// Someone else publishes what BG drives by, or commands the vehicle.
  [[nodiscard]] bool second_publisher(Stamp now) const;

 private:
  bool supervised_;
  Inbox<nav_state_t> nav_states_;
  Inbox<integrity_t> integrities_;
  Inbox<map_patch_t> map_patches_;
  Inbox<process_t> supervisor_;
  std::optional<Inbox<drive_t>> drives_;  // live only: in lockstep there is nobody else
  Stamp supervisor_received_ = Stamp::min();
  Integrity integrity_;
};

}  // namespace rcs::bg
