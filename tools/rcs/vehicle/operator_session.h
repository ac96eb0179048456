#pragma once
// The operator's side of the bus: sends commands to a subordinate until they are done, and shows
// their progress on a status line.

#include <optional>
#include <string>
#include <string_view>

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/command_port.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::cli {

/// How a command ended.
struct Ending {
  bool good = false;
  std::string result;  ///< "done", "error", "timeout", "interrupted", ...
  std::string reason;
};

[[nodiscard]] std::string_view name_of(CommandProgress::State state);

/// Of which an operator is the superior.
struct CommandedNode {
  std::string_view program;  ///< "rcs go"
  std::string_view name;     ///< "BG"
  std::string_view command_channel;
  std::string_view status_channel;
  Duration repeat;    ///< period at which a command is repeated until it is done
  Duration silence;   ///< without a status for longer the node does not run
  Duration patience;  ///< for the echo of a command that is sent once
};
extern const CommandedNode kBgNode;
extern const CommandedNode kMissionNode;

class OperatorSession {
 public:
  OperatorSession(LcmBus* bus, const CommandedNode& node);

  [[nodiscard]] Stamp now() const { return timeline_.now(); }
  [[nodiscard]] std::string state() const {
    return port_.status() == nullptr ? "" : port_.status()->state;
  }
  [[nodiscard]] const status_t* status() const { return port_.status(); }

  /// Waits for one tick. @return false if the program is to end or the bus is lost
  bool wait();
  /// The belief of WM if it is valid and not older than a second, else nullptr.
  const nav_state_t* belief();

  /// Sends the command repeatedly until it is done.
  /// @param most      time limit; a command that is not done by then has failed
  /// @param patience  an error ends the command only if it lasts this long: the node may be
  ///   restarting
  Ending pursue(rcs::Command command, Duration most, Duration patience);
  /// Sends the command and waits until it is echoed; a release until it is done.
  Ending send_once(rcs::Command command);
  /// Sends the emergency stop until BG has latched it: a BG that is down or cannot write may
  /// recover.
  Ending emergency_stop(Duration most);

  /// Ends the line, so that others can be printed.
  void end_line();

 private:
  void show(const CommandProgress& current, Duration since);
  [[nodiscard]] std::string of_node(std::string_view reason) const;

  const CommandedNode& node_;
  StopSignals stop_;
  LiveTimeline timeline_;
  CommandPort port_;
  Inbox<nav_state_t> nav_states_;
  bool terminal_;
  std::string shown_;
};

}  // namespace rcs::cli
