#include "sim/real_time.h"

#include <algorithm>

namespace rcs::sim {

RealTimeReport publish_at_real_time(Simulator* simulator, LcmBus* bus, LiveTimeline* timeline,
                                    const std::function<void(double)>& progress) {
  RealTimeReport report;
  const Duration shift = timeline->now() - Simulator::kStart;
  const double whole_s = seconds(simulator->end() - Simulator::kStart);
  SourceEvent event;
  double next_progress_s = 0.0;
  for (Stamp due = simulator->peek(); due != Stamp::max(); due = simulator->peek()) {
    simulator->take(&event);
    while (timeline->now() < due + shift) {
      if (timeline->advance(due + shift) == Timeline::Step::kEnded) {
        report.stopped = true;
        return report;
      }
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

}  // namespace rcs::sim
