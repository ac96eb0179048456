#pragma once
// Configuration of BG.

#include <string>
#include <vector>

#include "modules/bg/decide.h"
#include "modules/bg/hidden_ground.h"
#include "modules/bg/path.h"
#include "modules/bg/path_follow.h"
#include "modules/bg/path_search.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/result.h"
#include "rcs/node/budget.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "rcs/zones/zone_file.h"

namespace rcs::bg {

struct BgConfig {
  NodeInfo info{"bg", from_milliseconds(40.0), from_milliseconds(1.0)};
  Duration period = from_milliseconds(50.0);  ///< of drive
  Duration plan_period = from_milliseconds(250.0);
  Duration plan_compute = from_milliseconds(12.0);  ///< nominal, of a cycle that plans
  Duration drive_valid = from_milliseconds(250.0);  ///< of a drive command
  double max_speed_mps = 10.0;                      ///< of any command
  /// Issuers of commands that may release the emergency stops of other issuers.
  std::vector<std::string> release_authorities = {"operator"};
  double north_mps = 2.5;                ///< while the vehicle initializes its heading
  double north_m = 40.0;                 ///< largest distance straight ahead for that
  double near_goal_m = 8.0;              ///< increase of the goal radius if no path leads into it
  double accel_mps2 = 2.0;               ///< limit in every drive command, for speeding up only
  GrantParams grant{6000, 2500.0, 0.3};  ///< units: expansions of the search
  Shape shape;
  SearchParams search;
  FollowParams follow;
  DecideParams decide;
  SightParams sight;
  vj::Weights weights;
  vj::SpeedParams speeds;
  GeodeticZones zones;
};

/// Reads [bg] and the file of [world] zones; ignores the tables of other nodes.
[[nodiscard]] Result<BgConfig> load_bg_config(const ParamFile& file);

}  // namespace rcs::bg
