#include "modules/sp/sp_config.h"

#include "rcs/node/params/vehicle_tables.h"

namespace rcs::sp {
namespace {

void read(ParamTable table, LadarParams* p) {
  table.get("sensor_id", &p->sensor_id, {0, 32767});
  table.get("rows", &p->rows, {1, 1024});
  table.get("cols", &p->cols, {1, 4096});
  table.get_deg("fov_v_deg", &p->fov_v_rad, {0.1, 120});
  table.get_deg("fov_h_deg", &p->fov_h_rad, {0.1, 360});
  table.get("min_range_m", &p->min_range_m, {0, 10});
  table.get("max_range_m", &p->max_range_m, {1, 300});
  table.get("isolated_m", &p->isolated_m, {0, 10});
  table.get_pose("mount", &p->T_vehicle_mount, {-20, 20});
}

void read(ParamTable table, registration::IcpParams* p) {
  table.get("max_iterations", &p->max_iterations, {1, 200});
  table.get("min_pairs", &p->min_pairs, {6, 100000});
  table.get("gate_m", &p->gate_m, {0.05, 20});
  table.get("gate_sigma", &p->gate_sigma, {1, 20});
  table.get("range_sigma_m", &p->range_sigma_m, {0.001, 1});
  table.get_deg("beam_sigma_deg", &p->beam_sigma_rad, {0, 5});
  table.get("map_sigma_m", &p->map_sigma_m, {0.001, 1});
  table.get("least_map_sigma_m", &p->least_map_sigma_m, {0.001, 1});
  table.get("min_alignment", &p->min_alignment, {0, 0.5});
  table.get("max_sigma_m", &p->max_sigma_m, {0.001, 100});
  table.get("max_correction_m", &p->max_correction_m, {0.01, 100});
  table.get_deg("max_correction_deg", &p->max_correction_rad, {0.05, 180});
  table.get("step_sigma", &p->step_sigma, {1e-6, 1});
}

void read(ParamTable table, registration::RollingMapParams* p) {
  table.get("voxel_m", &p->voxel_m, {0.05, 5});
  table.get("capacity", &p->capacity, {1000, 4e6});
  table.get("radius_m", &p->radius_m, {5, 500});
  table.get("max_points", &p->max_points, {10, 10000});
  table.get("min_points", &p->min_points, {4, 1000});
  table.get("max_thickness", &p->max_thickness, {0.001, 1});
  table.get("min_extent", &p->min_extent, {0, 0.5});
}

void read(ParamTable table, PriorMatchParams* p) {
  table.get("max_iterations", &p->max_iterations, {1, 100});
  table.get("min_cells", &p->min_cells, {3, 10000});
  table.get("robust_sigma", &p->robust_sigma, {0.5, 20});
  table.get("gate_sigma", &p->gate_sigma, {1, 20});
  table.get("min_sigma_m", &p->min_sigma_m, {0.001, 10});
  table.get("foliage_m", &p->foliage_m, {0.001, 10});
  table.get("min_alignment", &p->min_alignment, {0, 0.5});
  table.get("max_sigma_m", &p->max_sigma_m, {0.01, 100});
  table.get("max_correction_m", &p->max_correction_m, {0.1, 1000});
  table.get_deg("max_correction_deg", &p->max_correction_rad, {0.05, 180});
  table.get("max_spread_m", &p->max_spread_m, {0, 10});
  table.get("step_sigma", &p->step_sigma, {1e-6, 1});
  ParamTable points = table.table("points");
  points.get("most", &p->points.most, {0, 20000});
  points.get("gate_m", &p->points.gate_m, {0.05, 5});
  points.get("min_sigma_m", &p->points.min_sigma_m, {0.001, 10});
  points.get("voxel_m", &p->points.voxel_m, {0.1, 20});
  points.get_deg("normal_sigma_deg", &p->points.normal_sigma_rad, {0, 57});
  points.get("min_voxels", &p->points.min_voxels, {1, 1000});
}

void read(ParamTable table, RelocateParams* p) {
  table.get("cell_m", &p->patch.cell_m, {0.2, 20});
  table.get("reach_m", &p->patch.reach_m, {5, 200});
  table.get("ground_sigma_m", &p->fit.ground_sigma_m, {0.01, 2});
  table.get("least_map_sigma_m", &p->fit.least_map_sigma_m, {0.001, 10});
  table.get("robust_sigma", &p->fit.robust_sigma, {1, 10});
  table.get("block_m", &p->fit.block_m, {1, 100});
  table.get_deg("tilt_sigma_deg", &p->fit.tilt_sigma_rad, {0.01, 5});
  table.get("plane_m", &p->fit.plane_m, {5, 200});
  table.get("least_way_m", &p->least_way_m, {1, 1000});
  table.get("every_m", &p->every_m, {1, 1000});
  table.get("window_m", &p->window_m, {10, 220});
  table.get("grid_m", &p->grid_m, {0.5, 50});
  table.get("hypotheses", &p->hypotheses, {100, 1e7});
  table.get("rough_samples", &p->rough_samples, {20, 10000});
  table.get("samples", &p->samples, {50, 10000});
  table.get("followed", &p->followed, {2, 200});
  table.get("rounds", &p->rounds, {3, 100});
  table.get("apart_m", &p->apart_m, {0.1, 100});
  table.get_deg("apart_deg", &p->apart_rad, {0.1, 45});
  table.get("most_cost", &p->most_cost, {0.1, 5});
  table.get("evidence", &p->evidence, {1, 1000});
  table.get("evidence_again", &p->evidence_again, {0.5, 1000});
  table.get("again_m", &p->again_m, {5, 1000});
  table.get("again_blocks", &p->again_blocks, {1, 1000});
  table.get("most_sigma_m", &p->most_sigma_m, {0.05, 20});
  table.get_deg("most_sigma_deg", &p->most_sigma_rad, {0.05, 30});
  table.get("drift", &p->drift, {0, 0.2});
  table.get("units", &p->units, {10000, 1e9});
}

/// [start], and what it needs of [world].
void read_start(ParamTable root, SpConfig* c) {
  if (!root.has("start")) return;
  ParamTable table = root.table("start");
  StartPlace start;
  table.get_deg("lat_deg", &start.place.lat_rad, {-90, 90});
  table.get_deg("lon_deg", &start.place.lon_rad, {-180, 360});
  table.get("within_m", &start.within_m, {1, 1000});
  table.get_deg("heading_deg", &start.heading_rad, {-360, 360});
  table.get_deg("heading_within_deg", &start.heading_within_rad, {0.5, 180});
  for (const std::string_view key : {"lat_deg", "lon_deg", "heading_deg"}) {
    if (!table.has(key)) table.fail(key, "is missing: a start is a place and a heading");
  }
  ParamTable world = root.table("world");
  Geodetic datum;
  world.get_deg("datum_lat_deg", &datum.lat_rad, {-90, 90});
  world.get_deg("datum_lon_deg", &datum.lon_rad, {-180, 360});
  world.get("datum_height_m", &datum.height.m, {-1000, 20000});
  for (const std::string_view key :
       {"prior_map", "datum_lat_deg", "datum_lon_deg", "datum_height_m"}) {
    if (!world.has(key)) {
      world.fail(key, "is missing: [start] needs a map, and a world before any fix");
    }
  }
  StartRegion region;
  region.radius_m = start.within_m;
  region.within_rad = start.heading_within_rad;
  if (!fits(region, c->relocate)) {
    table.fail("within_m", "with heading_within_deg takes more than [sp.relocate] hypotheses");
  }
  const double needed_m = start.within_m + c->relocate.window_m + c->relocate.patch.reach_m;
  if (c->prior_terrain.window.radius_m < needed_m) {
    world.fail("prior_map_radius_m",
               "must be at least within_m of [start], and window_m and reach_m of [sp.relocate]");
  }
  c->datum = datum;
  c->start = start;
}

void read(ParamTable table, GrantParams* p) {
  table.get("cap", &p->cap, {1, 1e12});
  table.get("nominal_unit_ns", &p->nominal_unit_ns, {0.1, 1e6});
  table.get("reserve", &p->reserve, {0, 0.99});
}

void read(ParamTable table, DegradeParams* p) {
  table.get("on", &p->on);
  table.get("coarser", &p->coarser, {1, 10});
  table.get("late_share", &p->late_share, {0.01, 10});
  table.get("behind", &p->behind, {0.01, 10});
  table.get("hold_behind", &p->hold_behind, {0.01, 10});
  table.get("hold_left", &p->hold_left, {0, 0.99});
  table.get("grant_full", &p->grant_full, {0, 100});
  table.get("grant_prior", &p->grant_prior, {0, 100});
  table.get("grant_hold", &p->grant_hold, {0, 100});
  table.get("recover_margin", &p->recover_margin, {1, 100});
  table.get("recover_after", &p->recover_after, {1, 10000});
  if (p->grant_hold > p->grant_prior || p->grant_prior > p->grant_full) {
    table.fail("grant_hold", "grant_hold, grant_prior and grant_full must ascend");
  }
}

}  // namespace

Result<SpConfig> load_sp_config(const ParamFile& file) {
  SpConfig c;
  ParamTable root = file.root();

  c.prior_terrain = read_prior_terrain(file);

  read(root.table("ladar"), &c.ladar);

  ParamTable sp = root.table("sp");
  sp.get_ms("budget_ms", &c.info.budget, {1, 10000});
  sp.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 10000});
  sp.get("source_voxel_m", &c.source_voxel_m, {0.05, 10});
  sp.get("map_voxel_m", &c.map_voxel_m, {0.02, 10});
  sp.get("publish_voxel_m", &c.publish_voxel_m, {0.02, 10});
  sp.get("prior_column_m", &c.prior_scan.column_m, {0.1, 50});
  sp.get("prior_standing_m", &c.prior_scan.standing_m, {0.05, 20});
  sp.get("prior_point_voxel_m", &c.prior_scan.voxel_m, {0.02, 10});
  sp.get("min_facets", &c.min_facets, {0, 1});
  sp.get_ms("facet_timeout_ms", &c.facet_timeout, {1, 1000});
  sp.get("reseed_after", &c.reseed_after, {1, 1000});
  sp.get("coast_sigma_m", &c.expectation.coast_sigma_m, {0.001, 100});
  sp.get_deg("coast_sigma_deg", &c.expectation.coast_sigma_rad, {0.01, 170});
  sp.get("prediction_sigma_scale", &c.expectation.sigma_scale, {0.1, 100});
  read(sp.table("icp"), &c.icp);
  read(sp.table("map"), &c.map);
  read(sp.table("prior"), &c.prior);
  read(sp.table("relocate"), &c.relocate);
  read(sp.table("grant"), &c.grant);
  read(sp.table("degrade"), &c.degrade);

  read_start(root, &c);

  if (Outcome read_all = file.finish(tables_but({"ladar", "sp", "start"})); !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::sp
