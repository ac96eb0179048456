#pragma once
// The choice of a route by the mission, as JSON.

#include "lcmtypes/rcs/routes_t.hpp"
#include "tools/report/json_document.h"

namespace rcs::evaluation {

/// The alert limit, whether GPS was received, and the candidates with their values; null: not
/// predicted.
[[nodiscard]] report::Json route_choice_json(const routes_t& choice);

}  // namespace rcs::evaluation
