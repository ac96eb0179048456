#pragma once
// The world of a scenario from TOML: relief, features, roads, rocks, vegetation.

#include <string>

#include "rcs/base/geodesy.h"
#include "rcs/node/params/params.h"
#include "sim/terrain/world.h"

namespace rcs::sim {

/// Reads [world]; see load_scenario().
/// @param dem  name of the file of the DEM as written; empty: none
void read_world(ParamTable table, WorldParams* world, bool* seed_follows, std::string* dem,
                Geodetic* datum);

}  // namespace rcs::sim
