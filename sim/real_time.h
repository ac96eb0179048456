#pragma once
// A simulation as a vehicle's sensors: onto the bus, at real time.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "sim/simulator.h"

namespace rcs::sim {

struct RealTimeReport {
  bool stopped = false;   ///< before the end
  Duration worst_late{};  ///< of a message
};

/// A stretch of time in which messages are not published, as if their driver had died.
struct Silence {
  std::string_view source;  ///< "ins", "gps", "odometry", "ladar" or "all" of them
  double begin_s = 0.0;
  double length_s = 0.0;

  /// SIM_TRUTH is never silent.
  [[nodiscard]] bool holds(std::string_view channel, double time_s) const;
};

/// Publishes until the scenario's end; a commanded vehicle hears BG_DRIVE meanwhile. Every message
/// has its own moment, so that no lateness adds up; it is made before it is due, while there is
/// time.
/// @param silences  what is not published, and when
/// @param progress  called once a simulated second with the share that is done, [0, 1]
RealTimeReport publish_at_real_time(Simulator* simulator, LcmBus* bus, LiveTimeline* timeline,
                                    const std::vector<Silence>& silences,
                                    const std::function<void(double)>& progress);

/// What a commanded vehicle did, for people; empty for another.
[[nodiscard]] std::string drive_summary(const Simulator& simulator);

}  // namespace rcs::sim
