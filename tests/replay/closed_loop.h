#pragma once
// The whole system in one thread: the simulated vehicle's sensors drive SP and WM, a driver (BG, or
// a stand-in) drives the vehicle, and an operator commands the driver. What happened is judged by
// the simulator's truth. Lockstep: the same scenario gives the same run.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "sim/simulator.h"

namespace rcs::test {

/// Makes the node that hears BG_COMMAND and says BG_STATUS and BG_DRIVE. The simulator is there for
/// stand-ins that know the truth.
using DriverFactory =
    std::function<std::unique_ptr<Node>(const ParamFile&, Bus*, const sim::Simulator&)>;

struct ClosedLoopOptions {
  std::string vehicle_config;  ///< path
  std::string more_config;     ///< TOML text behind it
  std::string prior_map;       ///< the a priori map is written here; empty: none
  std::int8_t frame = command_t::FRAME_WORLD;
  double radius_m = 3.0;      ///< of the waypoints
  double after_done_s = 1.0;  ///< the run goes on for so long
  BusTap* tap = nullptr;      ///< receives every message; null: none
};

struct ClosedLoopSample {
  Stamp stamp;
  Pose T_world_vehicle;  ///< truth
  double speed_mps = 0.0;
  double clearance_m = 0.0;
  bool gps = false;  ///< a fix has come within the last second
  /// In the truth's world. While WM has no world of its own: its local frame, hung on the truth at
  /// WM's first word.
  Pose T_world_believed;
  bool believed = false;
};

struct ClosedLoopPlan {
  Stamp stamp;
  std::vector<Vec2> points_world;  ///< as the vehicle sees them, from where it truly is
};

struct ClosedLoopRun {
  bool done = false;
  std::string reason;        ///< of the operator's last standing when it is not done
  std::string state;         ///< of the driver's last status
  std::string config_error;  ///< nothing was run

  std::vector<Vec2> waypoints_world;  ///< without the start
  std::vector<double> nearest_m;      ///< how near the vehicle truly came to each
  int reached = 0;                    ///< within their radius

  int collisions = 0;        ///< times that it ran into something hard
  int foliage_contacts = 0;  ///< times that it entered a bush or a low crown
  double least_clearance_m = 1e3;

  double time_s = 0.0;  ///< from the first command to DONE, or to the end
  double distance_m = 0.0;
  double mean_mps = 0.0;
  double fastest_mps = 0.0;
  double worst_lateral_mps2 = 0.0;  ///< speed times yaw rate
  double worst_error_m = 0.0;       ///< of the believed place, horizontal, while driving
  sim::DriveAccount drive;
  bool fenced = false;

  std::vector<ClosedLoopSample> trace;  ///< every 0.1 s
  std::vector<ClosedLoopPlan> plans;    ///< every second or so
};

/// @param scenario  commanded; its course's waypoints and speed are what the operator asks for,
///                  after the course's time of rest
[[nodiscard]] ClosedLoopRun run_closed_loop(const sim::Scenario& scenario,
                                            const ClosedLoopOptions& options,
                                            const DriverFactory& make_driver);

/// A picture of the run from above, a self-contained SVG.
[[nodiscard]] std::string draw(const ClosedLoopRun& run, const sim::Scenario& scenario,
                               const std::string& title);

/// Figures for people, several lines.
[[nodiscard]] std::string describe(const ClosedLoopRun& run);

}  // namespace rcs::test
