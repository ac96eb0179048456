#pragma once
// The whole system in one thread: the simulated vehicle's sensors drive SP and WM, a driver (BG, or
// a stand-in) drives the vehicle, and an operator commands the driver. The run is judged by the
// ground truth of the simulator. Lockstep: the same scenario gives the same run.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "sim/simulator.h"
#include "tools/driving/actor_notes.h"
#include "tools/driving/alert_notes.h"
#include "tools/driving/prediction_notes.h"
#include "tools/driving/source_losses.h"
#include "tools/driving/zone_course.h"

namespace rcs::driving {

/// Creates the node that receives BG_COMMAND and publishes BG_STATUS and BG_DRIVE. The simulator is
/// passed for stand-ins that use ground truth.
using DriverFactory =
    std::function<Result<std::unique_ptr<Node>>(const ParamFile&, Bus*, const sim::Simulator&)>;
/// BG.
[[nodiscard]] Result<std::unique_ptr<Node>> make_bg(const ParamFile& file, Bus* bus,
                                                    const sim::Simulator& simulator);

/// Who drives the course.
enum class Level {
  kBg,           ///< the operator commands BG
  kVisit,        ///< the operator gives the mission node the task to visit the waypoints
  kVisitReturn,  ///< and then to return to the start
};

struct ClosedLoopOptions {
  std::string vehicle_config;  ///< path
  std::string more_config;     ///< TOML text behind it
  std::string prior_map;       ///< the a priori map is written here; empty: none
  std::string zones;  ///< GeoJSON file of operating zones, judged by the truth; empty: none
  std::int8_t frame = command_t::FRAME_WORLD;
  Level level = Level::kBg;
  double radius_m = 3.0;       ///< of the waypoints
  double alert_limit_m = 0.0;  ///< horizontal, of the task; 0: that of the vehicle
  std::vector<SourceLoss> losses;
  double after_done_s = 1.0;             ///< the run continues for this time
  BusTap* tap = nullptr;                 ///< receives every message; null: none
  std::function<bool()> stop;            ///< ends the run early; empty: never
  std::function<void(double)> progress;  ///< share of the scenario's duration; empty: none
};

struct ClosedLoopSample {
  Stamp stamp;
  Pose T_world_vehicle;  ///< truth
  double speed_mps = 0.0;
  double clearance_m = 0.0;
  bool contact = false;  ///< began since the last sample: with ground, rock, trunk or actor
  bool gps = false;      ///< a fix has arrived within the last second
  /// In the world of the ground truth. While WM has no frame world: its frame local, aligned with
  /// the ground truth at WM's first message.
  Pose T_world_estimated;
  bool estimated = false;
};

struct ClosedLoopPlan {
  Stamp stamp;
  std::vector<Vec2> points_world;  ///< as observed by the vehicle, from its true pose
};

/// The way back against the way out, both true.
struct WayBackOutcome {
  double length_m = 0.0;       ///< of the way back; 0: there was none
  double lateral_rms_m = 0.0;  ///< distance from the way out, from the first place on it on
  double lateral_max_m = 0.0;
  double end_m = 0.0;  ///< from its start, at the end
};

struct ClosedLoopRun {
  bool done = false;
  std::string reason;        ///< reason of the operator's last status if the command is not done
  std::string state;         ///< of the driver's last status
  std::string config_error;  ///< nothing was run

  std::vector<Vec2> waypoints_world;  ///< without the start
  std::vector<double> nearest_m;      ///< smallest true distance of the vehicle to each
  int reached = 0;                    ///< within their radius

  int collisions = 0;        ///< number of collisions with hard objects
  int foliage_contacts = 0;  ///< number of contacts with a bush or a low crown
  double min_clearance_m = 1e3;
  sim::Simulator::Contacts contacts;  ///< with the ground
  ActorOutcome actors;                ///< moving ones of the scenario
  AlertOutcome alerts;
  std::vector<SourceLoss> losses;
  std::vector<Zone> zones_world;
  ZoneOutcome zones;

  double time_s = 0.0;  ///< from the first command to DONE, or to the end
  double distance_m = 0.0;
  double mean_mps = 0.0;
  double fastest_mps = 0.0;
  double worst_lateral_mps2 = 0.0;  ///< speed times yaw rate
  double worst_error_m = 0.0;       ///< of the estimated position, horizontal, while driving
  double worst_tilt_rad = 0.0;      ///< of the vehicle's vertical axis
  /// While WM states a horizontal protection level in frame world.
  double bounded_s = 0.0;
  double outside_level_s = 0.0;                    ///< of these, with the error above the level
  std::map<std::string, double> states_s;          ///< of the driver, and how long it was in each
  std::map<std::string, double> mission_states_s;  ///< likewise, of the mission node
  std::map<std::string, double> speed_limited_s;   ///< by what, see SpeedNotes
  WayBackOutcome way_back;
  PredictionOutcome predictions;
  sim::DriveAccount drive;
  bool fenced = false;

  std::vector<ClosedLoopSample> trace;  ///< every 0.1 s
  std::vector<ClosedLoopPlan> plans;    ///< every second or so
  std::vector<routes_t> routes;         ///< every choice of the mission node
};

/// @param scenario  commanded; the operator commands the waypoints and the speed of its course
/// after the course's time of rest
[[nodiscard]] ClosedLoopRun run_closed_loop(const sim::Scenario& scenario,
                                            const ClosedLoopOptions& options,
                                            const DriverFactory& make_driver);

/// Statistics as text, several lines.
[[nodiscard]] std::string describe(const ClosedLoopRun& run);

}  // namespace rcs::driving
