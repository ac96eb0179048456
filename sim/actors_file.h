#pragma once
// Moving actors of a scenario file: [[actor]] and [actors].

#include <vector>

#include "rcs/node/params/params.h"
#include "sim/actors/actor_draw.h"

namespace rcs::sim {

/// Tables [[actor]], which replace those of the base.
void read_actors(ParamTable* root, std::vector<ActorScript>* actors);

/// Table [actors].
void read_actor_params(ParamTable table, ActorParams* actors);

}  // namespace rcs::sim
