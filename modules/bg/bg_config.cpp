#include "modules/bg/bg_config.h"

#include <algorithm>

#include "rcs/node/params/vehicle_tables.h"

namespace rcs::bg {
namespace {

void read(ParamTable table, Shape* p) {
  table.get("length_m", &p->length_m, {0.5, 20});
  table.get("width_m", &p->width_m, {0.3, 5});
  table.get("max_curvature_1pm", &p->max_curvature_1pm, {0.01, 1});
  table.get("curvature_rate", &p->curvature_rate, {0.01, 10});
  table.get("margin_m", &p->margin_m, {0, 2});
  p->least_margin_m = std::min(p->least_margin_m, p->margin_m);
  table.get("least_margin_m", &p->least_margin_m, {0, p->margin_m});
  if (p->length_m > 3.0 * p->width_m) {
    table.fail("length_m", "must not be more than three times width_m");
  }
}

void read(ParamTable table, SearchParams* p, GrantParams* grant) {
  table.get("horizon_m", &p->horizon_m, {5, 200});
  table.get("arc_m", &p->arc_m, {0.4, 5});
  table.get("bin_m", &p->bin_m, {0.1, 2});
  table.get("headings", &p->headings, {8, 128});
  table.get("max_expansions", &p->max_expansions, {100, 1'000'000});
  table.get("nominal_expansion_ns", &grant->nominal_unit_ns, {1, 1e6});
  table.get("reserve", &grant->reserve, {0, 0.99});
  grant->cap = p->max_expansions;
}

void read(ParamTable table, FollowParams* p) {
  table.get("braking_mps2", &p->braking_mps2, {0.2, 5});
  table.get("lookahead_s", &p->lookahead_s, {0.1, 5});
  table.get("lookahead_min_m", &p->lookahead_min_m, {0.5, 20});
  table.get("latency_s", &p->latency_s, {0, 2});
  table.get("keep_cost", &p->keep_cost, {1, 10});
  table.get("keep_m", &p->keep_m, {1, 100});
  table.get("astray_m", &p->astray_m, {0.1, 10});
}

void read(ParamTable table, DecideParams* p) {
  table.get_ms("nav_silence_ms", &p->nav_silence, {50, 5000});
  table.get_ms("nav_still_ms", &p->nav_still, {50, 5000});
  table.get_ms("integrity_silence_ms", &p->integrity_silence, {200, 10000});
  table.get_ms("ins_loss_ms", &p->ins_loss, {100, 10000});
  table.get_ms("ladar_loss_ms", &p->ladar_loss, {100, 10000});
  table.get_ms("gps_loss_ms", &p->gps_loss, {100, 60000});
  table.get_ms("map_loss_ms", &p->map_loss, {100, 10000});
  table.get_ms("patience_ms", &p->patience, {1000, 600000});
  table.get("rest_mps", &p->rest_mps, {0.01, 1});
}

void read(ParamTable table, vj::Weights* p) {
  table.get("slope", &p->slope, {0, 100});
  table.get("roughness", &p->roughness, {0, 100});
  table.get("step", &p->step, {0, 100});
  table.get("unknown", &p->unknown, {0, 100});
  table.get("nearness", &p->nearness, {0, 100});
  table.get("near_m", &p->near_m, {0.1, 20});
  table.get_deg("max_slope_deg", &p->max_slope_rad, {3, 69});
  table.get("max_roughness_m", &p->max_roughness_m, {0.01, 1});
  table.get("max_step_m", &p->max_step_m, {0.05, 1});
  table.get("reverse", &p->reverse, {1, 100});
  table.get("turn_back", &p->turn_back, {0, 100});
}

void read(ParamTable table, vj::SpeedParams* p) {
  table.get("smooth_mps", &p->smooth_mps, {0.1, 30});
  table.get("rough_mps", &p->rough_mps, {0.1, 30});
  table.get("unknown_mps", &p->unknown_mps, {0.1, 30});
  table.get("near_mps", &p->near_mps, {0.1, 30});
  table.get("lateral_mps2", &p->lateral_mps2, {0.1, 10});
  table.get("sure_sigma_m", &p->sure_sigma_m, {0.01, 100});
  table.get("unsure_sigma_m", &p->unsure_sigma_m, {0.1, 1000});
  table.get("unsure_share", &p->unsure_share, {0.01, 1});
  table.get("alert_limit_horizontal_m", &p->alert_limit_horizontal_m, {0.5, 1000});
  table.get("alert_limit_vertical_m", &p->alert_limit_vertical_m, {0.5, 1000});
  if (p->unsure_sigma_m <= p->sure_sigma_m) {
    table.fail("unsure_sigma_m", "must be more than sure_sigma_m");
  }
}

}  // namespace

Result<BgConfig> load_bg_config(const ParamFile& file) {
  BgConfig c;
  ParamTable bg = file.root().table("bg");
  bg.get_ms("budget_ms", &c.info.budget, {1, 1000});
  bg.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000});
  bg.get_ms("period_ms", &c.period, {10, 500});
  bg.get_ms("plan_period_ms", &c.plan_period, {50, 5000});
  bg.get_ms("plan_compute_ms", &c.plan_compute, {0, 1000});
  bg.get_ms("drive_valid_ms", &c.drive_valid, {50, 2000});
  bg.get("max_speed_mps", &c.max_speed_mps, {0.1, 30});
  bg.get("north_mps", &c.north_mps, {0.1, 30});
  bg.get("north_m", &c.north_m, {5, 500});
  bg.get("near_goal_m", &c.near_goal_m, {0, 100});
  bg.get("accel_mps2", &c.accel_mps2, {0.1, 10});
  read(bg.table("shape"), &c.shape);
  read(bg.table("search"), &c.search, &c.grant);
  read(bg.table("follow"), &c.follow);
  read(bg.table("decide"), &c.decide);
  read(bg.table("weights"), &c.weights);
  read(bg.table("speeds"), &c.speeds);
  if (c.drive_valid <= c.period) bg.fail("drive_valid_ms", "must be more than period_ms");

  if (Outcome read_all = file.finish(tables_but({"bg"})); !read_all) return read_all.error();
  return c;
}

}  // namespace rcs::bg
