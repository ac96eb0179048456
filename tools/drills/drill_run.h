#pragma once
// One run of a drill: SP and WM in lockstep on disturbed messages. Open loop: the recorded drive
// does not depend on the nodes.

#include <functional>
#include <optional>
#include <string>

#include "modules/sp/sp_config.h"
#include "modules/wm/wm_config.h"
#include "rcs/base/result.h"
#include "rcs/terrain/elevation_map.h"
#include "tools/drills/drill_recorder.h"
#include "tools/drills/drill_scene.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// The configuration of the vehicle, read once.
struct DrillVehicle {
  sp::SpConfig sp;
  wm::WmConfig wm;
};
[[nodiscard]] Result<DrillVehicle> load_drill_vehicle(const std::string& path);

/// A separate run in which some source is excluded from the first stimulus on, as in a sub-filter
/// of WM.
enum class Denied { kNothing, kLadarOdometryAndGps, kLadar, kGps };

struct DrillRunOptions {
  Denied denied = Denied::kNothing;
  bool undisturbed = false;                   ///< no stimulus at all
  const DrillReference* reference = nullptr;  ///< nullptr: SIM_TRUTH
  std::string log;                            ///< path of a log of the run; empty: none
  std::function<bool()> stop;                 ///< polled; true ends the run
  std::function<void(double)> progress;       ///< called with the completed share; may be empty
};

struct DrillRunResult {
  DrillRecord record;
  std::optional<Geodetic> datum;  ///< of frame world of the record
};

/// @return an error if the run failed or `stop` returned true
[[nodiscard]] Result<DrillRunResult> run_drill(const Drill& drill, const DrillVehicle& vehicle,
                                               Scene* scene, const DrillRunOptions& options);

/// The a priori map with an artificial error: rotated about the origin of frame world, then
/// shifted.
[[nodiscard]] sim::PriorMap wrong_map(const sim::PriorMap& right, const Vec3& shift_m,
                                      double turn_rad);

}  // namespace rcs::drills
