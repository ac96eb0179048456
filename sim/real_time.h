#pragma once
// A simulation in place of the sensors of a vehicle: published on the bus at real time.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "sim/simulator.h"

namespace rcs::sim {

struct RealTimeReport {
  bool stopped = false;   ///< before the end of the scenario
  Duration worst_late{};  ///< largest lateness of a message
};

/// An interval in which messages are not published, as if their driver had failed.
struct Silence {
  std::string_view source;  ///< "ins", "gps", "odometry", "ladar" or "all" of them
  double begin_s = 0.0;
  double length_s = 0.0;

  /// SIM_TRUTH is always published.
  [[nodiscard]] bool holds(std::string_view channel, double time_s) const;
};

/// Publishes until the end of the scenario; a commanded vehicle receives BG_DRIVE meanwhile. Every
/// message has its own due time, so that lateness does not accumulate; it is computed before it is
/// due, while there is time.
/// @param silences  sources that are not published, and when
/// @param progress  called once a simulated second with the finished share, [0, 1]
RealTimeReport publish_at_real_time(Simulator* simulator, LcmBus* bus, LiveTimeline* timeline,
                                    const std::vector<Silence>& silences,
                                    const std::function<void(double)>& progress);

/// Summary of the drive of a commanded vehicle; empty for another.
[[nodiscard]] std::string drive_summary(const Simulator& simulator);

}  // namespace rcs::sim
