#pragma once
// The messages of a run that explain its state at one moment.

#include <chrono>
#include <deque>
#include <map>
#include <string>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/log/log_file.h"
#include "tools/evaluation/received.h"

namespace rcs::studies {

using evaluation::Received;

/// Messages received up to a moment, oldest first. Of the states only the newest.
struct MessageHistory {
  static constexpr Duration kRecent = std::chrono::seconds(1);   ///< explained by measurements
  static constexpr Duration kEvents = std::chrono::seconds(30);  ///< explained by events

  /// A malformed message counts as an input alone.
  void add(const LogEvent& event);

  Stamp now = Stamp::min();
  std::map<std::string, std::deque<Stamp>>
      inputs;  ///< arrivals by channel, within kRecent of its newest
  std::deque<Received<innovation_t>> innovations;
  std::deque<Received<registration_t>> registrations;
  std::deque<Received<nav_state_t>> nav;
  std::deque<Received<integrity_t>> integrity;
  std::deque<Received<drive_t>> drive;
  std::deque<Received<plan_t>> plan;
  std::deque<Received<status_t>> status;  ///< of BG
  std::deque<Received<status_t>> mission_status;
  std::deque<Received<routes_t>> routes;
  std::deque<Received<event_t>> events;
};

}  // namespace rcs::studies
