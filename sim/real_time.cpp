#include "sim/real_time.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::sim {

RealTimeReport publish_at_real_time(Simulator* simulator, LcmBus* bus, LiveTimeline* timeline,
                                    const std::function<void(double)>& progress) {
  RealTimeReport report;
  const Duration shift = timeline->now() - Simulator::kStart;
  const double whole_s = seconds(simulator->end() - Simulator::kStart);
  if (simulator->commanded()) simulator->listen(bus, shift);
  SourceEvent event;
  double next_progress_s = 0.0;
  for (Stamp due = simulator->peek(); due != Stamp::max(); due = simulator->peek()) {
    simulator->take(&event);
    // Late or not, what has come is heard.
    Timeline::Step step = Timeline::Step::kDelivered;
    while (step == Timeline::Step::kDelivered) step = timeline->advance(due + shift);
    if (step == Timeline::Step::kEnded) {
      report.stopped = true;
      return report;
    }
    report.worst_late = std::max(report.worst_late, timeline->now() - (due + shift));
    bus->publish(event.channel, event.data.data(), event.data.size());
    const double done_s = seconds(due - Simulator::kStart);
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
  return fmt::format(
      "drove {:.0f} m; drive commands: {} taken, {} implausible, {} stale, {} expired; braked {} "
      "times for want of one{}",
      simulator.driven_m(), a.taken, a.implausible, a.stale, a.expired, a.silences,
      vehicle.fenced() ? "; came to the border of the world" : "");
}

}  // namespace rcs::sim
