#include "modules/mission/mission_config.h"

#include "rcs/node/params/vehicle_tables.h"
#include "rcs/zones/zone_params.h"

namespace rcs::mission {
namespace {

constexpr double kMegabyte = 1048576.0;

void read(ParamTable table, RouteMapParams* p) {
  table.get("cell_m", &p->cell_m, {1, 50},
            "Edge of the cells in which routes are searched. Smaller: narrower passages are found, "
            "more compute time.");
  table.get_deg("max_slope_deg", &p->max_slope_rad, {1, 60},
                "Steeper ground of the a priori map is impassable.");
  table.get("ledge_m", &p->ledge_m, {0.1, 5},
            "Larger steps within a metre of the a priori map are impassable.");
  table.get("slope", &p->slope, {0, 100}, "Cost added per metre on the steepest slope [1].");
  table.get("unknown", &p->unknown, {0, 100},
            "Cost added per metre where the a priori map has no data [1].");
  table.get("match_each_m", &p->match_each_m, {5, 200},
            "Distance of the positions at which the localizability is computed at the start.");
  table.get("poor_sigma_m", &p->poor_sigma_m, {0.05, 100},
            "Standard deviation of a match to the a priori map that counts as no information.");
}

}  // namespace

Result<MissionConfig> load_mission_config(const ParamFile& file) {
  MissionConfig c;
  ParamTable table = file.root().table("mission");
  table.get_ms("budget_ms", &c.info.budget, {1, 1000},
               "Deadline of a cycle after its wakeup; a cycle that ends later is an overrun.");
  table.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000},
               "Compute time by which a replay delays the output of a cycle.");
  table.get_ms("period_ms", &c.period, {100, 1000},
               "Period of the decisions and of the commands to BG.");
  double memory_mb = 512.0;
  table.get("map_memory_mb", &memory_mb, {1, 1e5},
            "Largest memory for the whole a priori map at the start (2^20 bytes), of which the "
            "route map is made; a larger map is rejected.");
  c.map_memory_bytes = memory_mb * kMegabyte;
  table.get("alert_limit_m", &c.limits.alert_limit_m, {0.1, 1000},
            "Horizontal alert limit of a task that states none.");
  table.get("gps_loss_probability", &c.limits.gps_loss_probability, {0, 1},
            "Probability that GPS is lost during a task. Larger: longer routes are accepted for "
            "the sake of their features.");
  table.get("cost_of_exceedance_s", &c.limits.cost_of_exceedance_s, {0, 1e5},
            "Cost of a protection level above the alert limit, in seconds of driving [s].");
  table.get("speed_mps", &c.speed_mps, {0.1, 30},
            "Mean speed by which the time of a route is predicted.");
  table.get("max_speed_mps", &c.max_speed_mps, {0.1, 30},
            "Largest speed of a task that states none.");
  table.get(
      "corridor_m", &c.corridor_m, {0.5, 50},
      "Radius of the waypoints along a route. Larger: BG drives around obstacles more freely.");
  table.get("spacing_m", &c.spacing_m, {5, 200}, "Distance of the waypoints along a route.");
  table.get("way_back_m", &c.way_back_m, {0.5, 50}, "Radius of the waypoints of the way back.");
  table.get("way_back_mps", &c.way_back_mps, {0.1, 30}, "Largest speed on the way back.");
  table.get_ms("gps_loss_ms", &c.gps_loss, {500, 600'000},
               "Time without an accepted fix after which routes are chosen as without GPS.");
  table.get_ms("predict_again_ms", &c.predict_again, {2000, 600'000},
               "Interval at which the uncertainty along the rest of a route is predicted again; if "
               "it no longer keeps the alert limit, another route is searched.");
  table.get_ms("patience_ms", &c.decide.patience, {0, 600'000},
               "Time above the alert limit after which the vehicle returns on its own map.");
  table.get("max_blocked", &c.decide.max_blocked, {0, 100},
            "Blocked routes of a task after which it fails.");
  std::string loss = "continue";
  table.get("operator_lost", &loss, {"continue", "hold", "return"},
            "What happens to a task that its operator does not renew: continue, hold or return.");
  c.decide.operator_loss = loss == "hold"     ? OperatorLoss::kHold
                           : loss == "return" ? OperatorLoss::kReturn
                                              : OperatorLoss::kContinue;
  read(file.root().table("mission").table("map"), &c.map);
  c.prior = read_prior_terrain(file);
  c.zones = read_zones(file);
  if (Outcome read_all = file.finish(tables_but({"mission"})); !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::mission
