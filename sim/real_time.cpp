#include "sim/real_time.h"

#include <fmt/format.h>

#include <algorithm>

#include "lcmtypes/channels.h"

namespace rcs::sim {

bool Silence::holds(std::string_view channel, double time_s) const {
  if (channel == channel::kSimTruth || time_s < begin_s || time_s >= begin_s + length_s) {
    return false;
  }
  if (source == "all") return true;
  const std::string_view of = channel == channel::kIns        ? "ins"
                              : channel == channel::kGpsFix   ? "gps"
                              : channel == channel::kOdometry ? "odometry"
                                                              : "ladar";
  return source == of;
}

RealTimeReport publish_at_real_time(Simulator* simulator, LcmBus* bus, LiveTimeline* timeline,
                                    const std::vector<Silence>& silences,
                                    const std::function<void(double)>& progress) {
  RealTimeReport report;
  const Duration shift = timeline->now() - Simulator::kStart;
  const double whole_s = seconds(simulator->end() - Simulator::kStart);
  if (simulator->commanded()) simulator->listen(bus, shift);
  SourceEvent event;
  double next_progress_s = 0.0;
  for (Stamp due = simulator->peek(); due != Stamp::max(); due = simulator->peek()) {
    simulator->take(&event);
    // Deliver all that has arrived, even if late.
    Timeline::Step step = Timeline::Step::kDelivered;
    while (step == Timeline::Step::kDelivered) step = timeline->advance(due + shift);
    if (step == Timeline::Step::kEnded) {
      report.stopped = true;
      return report;
    }
    report.worst_late = std::max(report.worst_late, timeline->now() - (due + shift));
    const double done_s = seconds(due - Simulator::kStart);
    const bool silent = std::any_of(silences.begin(), silences.end(), [&](const Silence& silence) {
      return silence.holds(event.channel, done_s);
    });
    if (!silent) bus->publish(event.channel, event.data.data(), event.data.size());
    if (done_s < next_progress_s) continue;
    progress(std::min(1.0, done_s / whole_s));
    next_progress_s = done_s + 1.0;
  }
  return report;
}

std::string drive_summary(const Simulator& simulator) {
  if (!simulator.commanded()) return "";
  const CommandedVehicle& vehicle = *simulator.commanded_vehicle();
  const DriveAccount& a = vehicle.model().account();
  const std::int64_t rejected = simulator.rejected_commands();
  return fmt::format(
      "drove {:.0f} m; drive commands: {} accepted, {} implausible, {} stale, {} expired{}; braked "
      "{} times without a valid command{}",
      simulator.driven_m(), a.taken, a.implausible, a.stale, a.expired,
      rejected > 0 ? fmt::format(", {} of a second publisher", rejected) : "", a.silences,
      vehicle.fenced() ? "; stopped at the border of the world" : "");
}

}  // namespace rcs::sim
