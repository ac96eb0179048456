#include "tools/evaluation/route_json.h"

#include <utility>

#include "lcmtypes/message_names.h"

namespace rcs::evaluation {

report::Json route_choice_json(const routes_t& choice) {
  report::Json candidates = report::Json::array();
  for (const route_t& r : choice.route) {
    candidates.push_back({{"verdict", route_verdict_name(r.verdict)},
                          {"poverty_weight", r.poverty_weight},
                          {"length_m", r.length_m},
                          {"time_s", r.time_s},
                          {"level_max_m", r.level_max_m},
                          {"risk", r.risk},
                          {"cost_s", r.cost_s}});
  }
  return {{"alert_limit_m", choice.alert_limit_m},
          {"gps", choice.gps != 0},
          {"candidates", std::move(candidates)}};
}

}  // namespace rcs::evaluation
