#include "modules/bg/stop_node.h"

#include <fmt/format.h>

#include <iterator>

#include "lcmtypes/events.h"

namespace rcs::bg {
namespace {

constexpr Duration kTryAgain = from_seconds(1.0);  // after a failed attempt to write the file

}  // namespace

bool EmergencyStop::update(const command_t* command, bool is_new, Stamp now, Report* report,
                           Decision* decision) {
  const bool new_stop =
      is_new && command != nullptr && command->kind == command_t::KIND_EMERGENCY_STOP;
  if (!started_) report_start(now, report);
  if (decision->emergency) {
    if (new_stop || (!latch_.engaged() && command != nullptr)) {
      // The gateway repeats its stop with new serials as long as it is latched there.
      const bool latched = latch_.engaged();
      latch_.engage(*command);
      if (!latched) {
        report->publish(now, event::kBgStopEngaged,
                        "emergency stop of {}: no motion until it is released at rest",
                        latch_.cause());
      }
      if (!latch_.persisted()) next_try_ = now;
    }
    keep(now, report, decision);
    return false;
  }
  if (!latch_.engaged()) return false;
  const std::string cause = latch_.cause();
  if (const Outcome released = latch_.release(); !released) {
    report->publish(now, event::kBgStopRelease, "emergency stop not released, stays latched: {}",
                    released.error().message);
    reason_ = "emergency stop stays latched: " + released.error().message;
    *decision = {Action::kBrake, Status::kError, "EMERGENCY_STOP", reason_, decision->line, true};
    return false;
  }
  report->publish(now, event::kBgStopReleased, "emergency stop of {} released", cause);
  return true;
}

void EmergencyStop::report_start(Stamp now, Report* report) {
  started_ = true;
  if (!latch_.engaged()) return;
  report->publish(
      now, event::kBgStopLatched,
      "an emergency stop is latched since before the start ({}; {}): no motion until it is "
      "released at rest",
      latch_.cause(), latch_.path());
}

void EmergencyStop::keep(Stamp now, Report* report, Decision* decision) {
  if (!latch_.persisted() && now >= next_try_) {
    next_try_ = now + kTryAgain;
    const Outcome persisted = latch_.persist();
    trouble_ = persisted ? "" : persisted.error().message;
    if (!persisted) {
      report->publish(now, event::kBgStopNotPersisted,
                      "emergency stop in force, but lost if BG restarts: {}", trouble_);
    }
  }
  reason_.clear();  // keeps its capacity
  if (!latch_.persisted()) {
    decision->status = Status::kError;
    fmt::format_to(std::back_inserter(reason_), "emergency stop in force, but not persisted: {}",
                   trouble_);
  } else if (!decision->reason.empty()) {
    fmt::format_to(std::back_inserter(reason_), "{} (stopped by {})", decision->reason,
                   latch_.cause());
  }
  decision->reason = reason_;
}

}  // namespace rcs::bg
