#pragma once
// The world of a scenario from TOML: relief, features, roads, rocks, vegetation; and lines in it.

#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/node/params/params.h"
#include "sim/terrain/world.h"

namespace rcs::sim {

/// Appends the places of an array of tables, which are at least 1 m apart.
void read_line(ParamTable* table, const char* key, std::vector<Vec2>* places_world);

/// Reads [world]; see load_scenario().
/// @param dem  name of the file of the DEM as written; empty: none
void read_world(ParamTable table, WorldParams* world, bool* seed_follows, std::string* dem,
                Geodetic* datum);

}  // namespace rcs::sim
