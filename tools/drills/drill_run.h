#pragma once
// One run of a drill: SP and WM in lockstep on messages that a stimulus changed. Open loop: the
// drive is the recorded one, whatever the nodes say.

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

/// The vehicle's configuration, read once.
struct DrillVehicle {
  sp::SpConfig sp;
  wm::WmConfig wm;
};
[[nodiscard]] Result<DrillVehicle> load_drill_vehicle(const std::string& path);

/// A filter that goes without some source from the drill's begin on: what WM's sub-filters are, run
/// for itself.
enum class Withheld { kNothing, kLadarOdometryAndGps, kLadar, kGps };

struct DrillRunOptions {
  Withheld withheld = Withheld::kNothing;
  bool undisturbed = false;                   ///< no stimulus at all
  const DrillReference* reference = nullptr;  ///< null: SIM_TRUTH
  std::string log;                            ///< what was said is written there; empty: nowhere
  std::function<bool()> stop;                 ///< asked now and then
};

struct DrillRunResult {
  DrillRecord record;
  std::optional<Geodetic> datum;  ///< of the record's world
};

/// @return an error when it could not be done, or `stop` said so
[[nodiscard]] Result<DrillRunResult> run_drill(const Drill& drill, const DrillVehicle& vehicle,
                                               Scene* scene, const DrillRunOptions& options);

/// The a priori map with an error of its own: turned about the origin of frame world, then shifted.
[[nodiscard]] sim::PriorMap wrong_map(const sim::PriorMap& right, const Vec3& shift_m,
                                      double turn_rad);

}  // namespace rcs::drills
