#include "modules/bg/stop_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "lcmtypes/events.h"

namespace rcs::bg {

void EmergencyStop::engage(const std::vector<stop_t>& stops, Stamp now, Report* report) {
  if (!started_) {
    started_ = true;
    if (latch_.engaged()) {
      report->publish(
          now, event::kBgStopLatched,
          "an emergency stop is latched since before the start ({}; {}): no motion until it is "
          "released at rest",
          latch_.cause(), latch_.path());
    }
  }
  for (const stop_t& stop : stops) {
    const std::size_t before = latch_.stops().size();
    latch_.engage(stop);
    if (latch_.stops().size() == before) continue;
    not_released_.clear();
    report->publish(now, event::kBgStopEngaged,
                    "emergency stop of {}: no motion until it is released at rest", latch_.cause());
  }
}

void EmergencyStop::update(const command_t* command, Stamp now, Report* report,
                           Decision* decision) {
  if (!latch_.engaged()) return;
  cause_ = latch_.cause();
  if (decision->release && command != nullptr) release(*command, decision);
  take_step(latch_.step(now), now, report, decision);
  if (latch_.engaged()) describe_state(command, decision);
}

void EmergencyStop::release(const command_t& command, Decision* decision) {
  const auto n = std::min(static_cast<std::size_t>(command.n_stops), command.stop_id.size());
  const std::vector<std::int64_t> ids(command.stop_id.begin(),
                                      command.stop_id.begin() + static_cast<std::ptrdiff_t>(n));
  const bool authority =
      std::find(authorities_.begin(), authorities_.end(), command.issuer) != authorities_.end();
  not_released_.clear();
  switch (latch_.release(ids, command.issuer, authority, from_utime(command.valid_until_utime))) {
    case StopLatch::Release::kAll:
      break;
    case StopLatch::Release::kSome:
      not_released_ = fmt::format("a stop of {} stays latched", latch_.cause());
      break;
    case StopLatch::Release::kNone:
      not_released_ = fmt::format(
          "the release names no stop in force that {} has set, and {} is not in [bg] "
          "release_authorities; stopped by {}",
          command.issuer, command.issuer, latch_.cause());
      if (authority) {
        not_released_ =
            fmt::format("the release names no stop in force; stopped by {}", latch_.cause());
      }
      break;
  }
  decision->status = Status::kExecuting;
}

void EmergencyStop::take_step(const StopLatch::Step& step, Stamp now, Report* report,
                              Decision* decision) {
  switch (step.event) {
    case StopLatch::Step::Event::kNone:
      break;
    case StopLatch::Step::Event::kReleased:
      report->publish(now, event::kBgStopReleased, "emergency stop of {} released", cause_);
      trouble_.clear();
      *decision = {Action::kStop, Status::kDone, "RELEASED", "", decision->line, false, false};
      return;
    case StopLatch::Step::Event::kNotReleased:
      report->publish(now, event::kBgStopRelease, "emergency stop not released, stays latched: {}",
                      step.trouble);
      not_released_ = step.trouble;
      return;
    case StopLatch::Step::Event::kNotWritten:
      report->publish(now, event::kBgStopNotPersisted,
                      "emergency stop in force, but lost if BG restarts: {}", step.trouble);
      trouble_ = step.trouble;
      return;
  }
  if (latch_.persisted()) trouble_.clear();
}

void EmergencyStop::describe_state(const command_t* command, Decision* decision) {
  reason_.clear();  // keeps its capacity
  const auto text = std::back_inserter(reason_);
  const bool by_release = command != nullptr && command->kind == command_t::KIND_RELEASE;
  if (by_release && latch_.releasing()) {
    decision->status = Status::kExecuting;
    fmt::format_to(text, "release accepted, the file of the latch is being removed");
  } else if (by_release && !not_released_.empty()) {
    decision->status = Status::kError;
    fmt::format_to(text, "emergency stop stays latched: {}", not_released_);
  } else if (!trouble_.empty()) {
    decision->status = Status::kError;
    fmt::format_to(text, "emergency stop in force, but not persisted: {}", trouble_);
  } else if (!decision->reason.empty()) {
    fmt::format_to(text, "{} (stopped by {})", decision->reason, cause_);
  }
  decision->reason = reason_;
}

void EmergencyStop::describe(StatusReport* status) const {
  status->stops = &latch_.stops();
  status->emergency_stop = !latch_.engaged()    ? status_t::STOP_NONE
                           : latch_.persisted() ? status_t::STOP_PERSISTED
                                                : status_t::STOP_LATCHED;
}

}  // namespace rcs::bg
