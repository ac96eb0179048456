#include "modules/sp/sp_config.h"

#include "rcs/node/params/ladar_mount.h"
#include "rcs/node/params/vehicle_tables.h"

namespace rcs::sp {
namespace {

void read(ParamTable table, LadarParams* p) {
  table.get("sensor_id", &p->sensor_id, {0, 32767},
            "Identifier of the LADAR; facets with another sensor_id are rejected.");
  table.get("rows", &p->rows, {1, 1024}, "Rows of the range image; row 0 is the lowest.");
  table.get("cols", &p->cols, {1, 4096}, "Columns of the range image; column 0 is the leftmost.");
  table.get_deg("fov_v_deg", &p->fov_v_rad, {0.1, 120},
                "Vertical field of view of the range image, divided equally among its rows.");
  table.get_deg("fov_h_deg", &p->fov_h_rad, {0.1, 360},
                "Horizontal field of view of the range image, divided equally among its columns.");
  table.get("min_range_m", &p->min_range_m, {0, 10},
            "Smallest range used; nearer returns are the vehicle's own body.");
  table.get("max_range_m", &p->max_range_m, {1, 300},
            "Largest range used; farther returns are rejected.");
  table.get("isolated_m", &p->isolated_m, {0, 10},
            "A return that differs from all its neighbours by more than this plus 5 % of its range "
            "is removed as a mixed pixel; 0: none is removed.");
  read_ladar_mount(table, &p->T_vehicle_mount);
}

void read(ParamTable table, registration::IcpParams* p) {
  table.get("max_iterations", &p->max_iterations, {1, 200},
            "Iteration limit of the registration. Larger: fewer unfinished registrations, more "
            "compute time.");
  table.get(
      "min_pairs", &p->min_pairs, {6, 100000},
      "Fewest matched points with which a scan is registered; with fewer the registration fails.");
  table.get("gate_m", &p->gate_m, {0.05, 20},
            "Initial gate on the distance of a point to its surface; it is halved at each "
            "iteration, down to the gate by gate_sigma.");
  table.get("gate_sigma", &p->gate_sigma, {1, 20},
            "Final gate on the distance of a point to its surface, in standard deviations of the "
            "residual. Larger: fewer points are rejected.");
  table.get("range_sigma_m", &p->range_sigma_m, {0.001, 1},
            "Range noise of the LADAR, one standard deviation.");
  table.get_deg("beam_sigma_deg", &p->beam_sigma_rad, {0, 5},
                "Pointing noise of the LADAR across the beam, one standard deviation.");
  table.get("map_sigma_m", &p->map_sigma_m, {0.001, 1},
            "Error of a map surface in the outlier test, one standard deviation. Larger: fewer "
            "outliers are rejected, as is needed in grass.");
  table.get("min_map_sigma_m", &p->min_map_sigma_m, {0.001, 1},
            "Smallest standard deviation of the error that the points of a map voxel share. "
            "Larger: matches are published with a larger covariance.");
  table.get("min_alignment", &p->min_alignment, {0, 0.5},
            "Observability (mean squared alignment of the surface normals [1]) below which a "
            "direction counts as unobserved.");
  table.get("max_sigma_m", &p->max_sigma_m, {0.001, 100},
            "Standard deviation above which a direction counts as unobserved and follows the "
            "prediction.");
  table.get("max_correction_m", &p->max_correction_m, {0.01, 100},
            "Largest distance of the result from the prediction; beyond it the registration has "
            "diverged and fails.");
  table.get_deg("max_correction_deg", &p->max_correction_rad, {0.05, 180},
                "Largest rotation of the result from the prediction; beyond it the registration "
                "has diverged and fails.");
  table.get("step_sigma", &p->step_sigma, {1e-6, 1},
            "Step, in standard deviations of the pose, below which the registration has converged. "
            "Smaller: more iterations.");
}

void read(ParamTable table, registration::RollingMapParams* p) {
  table.get(
      "voxel_m", &p->voxel_m, {0.05, 5},
      "Largest edge of the fine voxels of the rolling map; the coarse voxels are three times as "
      "large. Near surfaces need smaller ones: the edge is at most 0.06 of the median range of the "
      "scan that begins the map, but at least nine times [sp.icp] map_sigma_m.");
  table.get("capacity", &p->capacity, {1000, 4e6},
            "Largest number of voxels of each size in the rolling map; when it is nearly full the "
            "farthest are removed.");
  table.get("radius_m", &p->radius_m, {5, 500},
            "Radius around the vehicle beyond which the rolling map is removed.");
  table.get("archive", &p->archive, {0, 4e6},
            "Removed voxels of each size that are kept for the way back, 64 bytes each: a vehicle "
            "that drives back on its own way finds the map of the way out again. When it is full, "
            "what was removed first is dropped. 0: off.");
  table.get("max_points", &p->max_points, {10, 10000},
            "Points with which a voxel is complete; it is not updated any more, so that later pose "
            "errors do not shift it.");
  table.get("min_points", &p->min_points, {4, 1000},
            "Fewest points of a voxel to which a surface is fitted.");
  table.get("max_thickness", &p->max_thickness, {0.001, 1},
            "Largest ratio of thickness to width of a surface: smallest over middle standard "
            "deviation of the voxel's points [1].");
  table.get("min_extent", &p->min_extent, {0, 0.5},
            "Smallest width of a surface: middle standard deviation of the points over the edge of "
            "the voxel [1]. It rejects single scan lines.");
}

void read(ParamTable table, PriorMatchParams* p) {
  table.get("max_iterations", &p->max_iterations, {1, 100},
            "Iteration limit of the match to the a priori map. Larger: fewer unfinished matches, "
            "more compute time.");
  table.get("min_cells", &p->min_cells, {3, 10000},
            "Fewest map cells with points of the scan; with fewer the match fails.");
  table.get("robust_sigma", &p->robust_sigma, {0.5, 20},
            "Residual, in standard deviations, at which its robust weight is 1/4. Smaller: "
            "vegetation above the ground has less influence.");
  table.get("gate_sigma", &p->gate_sigma, {1, 20},
            "Gate on the residuals of ground and above-ground points, in standard deviations; "
            "points with larger residuals are not used.");
  table.get("min_sigma_m", &p->min_sigma_m, {0.001, 10},
            "Smallest standard deviation of a ground height, whatever the map states. Larger: the "
            "map weighs less.");
  table.get("foliage_m", &p->foliage_m, {0.001, 10},
            "Depth to which light enters vegetation before it returns, one standard deviation; "
            "each match estimates it. Larger: less pull by grass on slopes.");
  table.get("min_alignment", &p->min_alignment, {0, 0.5},
            "Observability (mean squared alignment of the surface normals [1]) below which a "
            "direction counts as unobserved.");
  table.get("max_sigma_m", &p->max_sigma_m, {0.01, 100},
            "Standard deviation above which a direction counts as unobserved and follows the "
            "prediction.");
  table.get("max_correction_m", &p->max_correction_m, {0.1, 1000},
            "Largest distance of the result from the prediction; beyond it the match has diverged "
            "and fails.");
  table.get_deg("max_correction_deg", &p->max_correction_rad, {0.05, 180},
                "Largest rotation of the result from the prediction; beyond it the match has "
                "diverged and fails.");
  table.get("max_spread_m", &p->max_spread_m, {0, 10},
            "Largest initial inflation of the residuals' standard deviation for an uncertain "
            "prediction; it decays to zero. Larger: wider convergence region.");
  table.get("search_sigma_m", &p->search_sigma_m, {0.1, 1000},
            "Horizontal standard deviation of the prediction above which all positions and "
            "headings around it are searched, on maps with cells of 4 m or less and without "
            "surface points; 1000: never. Scans with many objects are mostly refused.");
  table.get("step_sigma", &p->step_sigma, {1e-6, 1},
            "Step, in standard deviations of the pose, below which the match has converged. "
            "Smaller: more iterations.");
  ParamTable points = table.table("points");
  points.get("max_points", &p->points.max_points, {0, 20000},
             "Largest number of above-ground points of a scan that are matched to the map's "
             "surface points; 0: none are matched.");
  points.get("gate_m", &p->points.gate_m, {0.05, 5},
             "Largest distance between an above-ground point and the map's surface point, beyond "
             "the inflation for an uncertain prediction.");
  points.get("min_sigma_m", &p->points.min_sigma_m, {0.001, 10},
             "Smallest standard deviation of a surface point of the map, whatever the map states. "
             "Larger: above-ground structure weighs less.");
  points.get("voxel_m", &p->points.voxel_m, {0.1, 20},
             "Edge of the cubes in which the points of a scan share the map's error and together "
             "count as one observation.");
  points.get_deg("normal_sigma_deg", &p->points.normal_sigma_rad, {0, 57},
                 "Error of the surface normals of the map's points, one standard deviation.");
  points.get("min_voxels", &p->points.min_voxels, {1, 1000},
             "Fewest cubes with matches for above-ground structure to be used at all.");
}

void read(ParamTable table, InitialLocalizationParams* p) {
  table.get("cell_m", &p->patch.cell_m, {0.2, 20},
            "Edge of the ground cells collected along the path; each keeps its lowest point.");
  table.get("reach_m", &p->patch.reach_m, {5, 200},
            "Range around the vehicle within which ground is collected; farther away a tilted scan "
            "contributes little.");
  table.get("ground_sigma_m", &p->fit.ground_sigma_m, {0.01, 2},
            "Deviation of the lowest point of a cell from the ground (grass, rocks), one standard "
            "deviation.");
  table.get("min_map_sigma_m", &p->fit.min_map_sigma_m, {0.001, 10},
            "Smallest standard deviation of a map height, whatever the map states. Larger: more "
            "ground is needed for a decision.");
  table.get("robust_sigma", &p->fit.robust_sigma, {1, 10},
            "Bound of a residual's cost, which is at most half the square of this (in standard "
            "deviations). Larger: outliers cost more.");
  table.get("block_m", &p->fit.block_m, {1, 100},
            "Edge of the blocks of ground whose cells share their errors and together count as one "
            "observation.");
  table.get_deg("tilt_sigma_deg", &p->fit.tilt_sigma_rad, {0.01, 5},
                "Tilt of the levelled local frame against the vertical, one standard deviation.");
  table.get("plane_m", &p->fit.plane_m, {5, 200},
            "Edge of the squares of ground whose fitted planes are the alternative hypothesis that "
            "the map must outperform.");
  table.get("min_travelled_m", &p->min_travelled_m, {1, 1000},
            "Distance driven before the first search.");
  table.get("every_m", &p->every_m, {1, 1000}, "Distance driven between one search and the next.");
  table.get("window_m", &p->window_m, {10, 220},
            "Length of the path whose ground is searched for on the map; a candidate must be "
            "confirmed within the same length again.");
  table.get("grid_m", &p->grid_m, {0.5, 50},
            "Spacing of the position hypotheses; the spacing of the headings follows from it. "
            "Smaller: more hypotheses and work.");
  table.get("hypotheses", &p->hypotheses, {100, 1e7},
            "Largest number of hypotheses of a search. A [start] that needs more is an error.");
  table.get(
      "rough_samples", &p->rough_samples, {20, 10000},
      "Ground samples for each hypothesis of the coarse search; a search needs at least as many.");
  table.get("samples", &p->samples, {50, 10000},
            "Ground samples for each candidate pose that is refined.");
  table.get("refined", &p->refined, {2, 200}, "Number of the best hypotheses that are refined.");
  table.get("rounds", &p->rounds, {3, 100},
            "Largest number of refinement rounds of a candidate pose.");
  table.get(
      "apart_m", &p->apart_m, {0.1, 100},
      "Candidates nearer than this, and turned by less than apart_deg, count as the same pose.");
  table.get_deg(
      "apart_deg", &p->apart_rad, {0.1, 45},
      "Candidates turned by less than this, and nearer than apart_m, count as the same pose.");
  table.get("max_cost", &p->max_cost, {0.1, 5},
            "Largest mean cost of a block at an accepted pose [1]; 0.5 is expected. Larger: poorer "
            "fits are accepted.");
  table.get("evidence", &p->evidence, {1, 1000},
            "Log-likelihood ratio [1] by which the best pose must exceed both fitted planes and "
            "the next-best pose. Larger: later but safer decision.");
  table.get("confirm_evidence", &p->confirm_evidence, {0.5, 1000},
            "Log-likelihood ratio [1] by which newly observed ground at the candidate pose must "
            "exceed fitted planes to confirm it.");
  table.get("confirm_m", &p->confirm_m, {5, 1000},
            "Distance driven on new ground before a candidate pose can be confirmed.");
  table.get("confirm_blocks", &p->confirm_blocks, {1, 1000},
            "Blocks of new ground required before a candidate pose is confirmed or refuted.");
  table.get("max_sigma_m", &p->max_sigma_m, {0.05, 20},
            "Largest position standard deviation along any direction of an accepted pose.");
  table.get_deg("max_sigma_deg", &p->max_sigma_rad, {0.05, 30},
                "Largest heading standard deviation of an accepted pose.");
  table.get(
      "drift", &p->drift, {0, 0.2},
      "Drift per metre driven [1], by which the resulting start may lie outside the start region.");
  table.get("units", &p->units, {10000, 1e9},
            "Largest number of work units for the search per scan; it also takes no more than is "
            "granted.");
}

/// [start], and what it needs of [world].
void read_start(ParamTable root, SpConfig* c) {
  if (!root.has("start")) return;
  ParamTable table = root.table("start");
  StartPlace start;
  table.get_deg(
      "lat_deg", &start.place.lat_rad, {-90, 90},
      "Latitude of the middle of the start region, for a start without GPS on the a priori map.");
  table.get_deg(
      "lon_deg", &start.place.lon_rad, {-180, 360},
      "Longitude of the middle of the start region, for a start without GPS on the a priori map.");
  table.get(
      "within_m", &start.within_m, {1, 1000},
      "Radius of the start region. Larger: a longer search that needs more distinctive ground.");
  table.get_deg("heading_deg", &start.heading_rad, {-360, 360},
                "Heading of the vehicle at the start, clockwise from north.");
  table.get_deg("heading_within_deg", &start.heading_within_rad, {0.5, 180},
                "Uncertainty of the heading at the start to either side. Larger: a longer search.");
  for (const std::string_view key : {"lat_deg", "lon_deg", "heading_deg"}) {
    if (!table.has(key)) table.fail(key, "is missing: [start] needs a position and a heading");
  }
  ParamTable world = root.table("world");
  Geodetic datum;
  world.get_deg(
      "datum_lat_deg", &datum.lat_rad, {-90, 90},
      "Latitude of the origin of frame world. Without a datum the first fix is the origin.");
  world.get_deg(
      "datum_lon_deg", &datum.lon_rad, {-180, 360},
      "Longitude of the origin of frame world. Without a datum the first fix is the origin.");
  world.get("datum_height_m", &datum.height.m, {-1000, 20000},
            "Ellipsoidal height of the origin of frame world. Without a datum the first fix is the "
            "origin.");
  for (const std::string_view key :
       {"prior_map", "datum_lat_deg", "datum_lon_deg", "datum_height_m"}) {
    if (!world.has(key)) {
      world.fail(key, "is missing: [start] needs an a priori map and the datum of frame world");
    }
  }
  StartRegion region;
  region.radius_m = start.within_m;
  region.within_rad = start.heading_within_rad;
  if (!fits(region, c->initial_localization)) {
    table.fail("within_m",
               "with heading_within_deg requires more hypotheses than [sp.initial_localization] "
               "hypotheses allows");
  }
  const double needed_m =
      start.within_m + c->initial_localization.window_m + c->initial_localization.patch.reach_m;
  if (c->prior_terrain.window.radius_m < needed_m) {
    world.fail("prior_map_radius_m",
               "must be at least the sum of within_m of [start] and window_m and reach_m of "
               "[sp.initial_localization]");
  }
  c->datum = datum;
  c->start = start;
}

void read(ParamTable table, GrantParams* p) {
  table.get("cap", &p->cap, {1, 1e12},
            "Largest work grant of a scan, in work units (one point in one iteration).");
  table.get("nominal_unit_ns", &p->nominal_unit_ns, {0.1, 1e6},
            "Compute time of a work unit on the vehicle's computer. Larger: less work is granted "
            "in the same time.");
  table.get("reserve", &p->reserve, {0, 0.99},
            "Share of the time to the deadline that is not granted as work. Larger: fewer "
            "overruns, more unfinished registrations.");
}

void read(ParamTable table, DegradeParams* p) {
  table.get(
      "on", &p->on,
      "Leaves out work under load to keep the deadline; false: every scan is processed in full.");
  table.get(
      "coarser", &p->coarser, {1, 10},
      "Factor on source_voxel_m for a degraded scan [1]. Larger: fewer points are registered.");
  table.get("late_share", &p->late_share, {0.01, 10},
            "Delay of a cycle's start, as a share of budget_ms, from which the degrade level rises "
            "by one.");
  table.get(
      "behind", &p->behind, {0.01, 10},
      "Facets that already wait, as a share of a scan, from which the degrade level rises by one.");
  table.get(
      "hold_behind", &p->hold_behind, {0.01, 10},
      "Facets that already wait, as a share of a scan, from which the scan is held (published "
      "without a registration).");
  table.get("hold_left", &p->hold_left, {0, 0.99},
            "Time left to the deadline, as a share of budget_ms, below which the scan is held "
            "(published without a registration).");
  table.get(
      "grant_full", &p->grant_full, {0, 100},
      "Granted work, as a share of the nominal need, below which fewer points are registered.");
  table.get("grant_prior", &p->grant_prior, {0, 100},
            "Granted work, as a share of the nominal need, below which the scan is not matched to "
            "the a priori map.");
  table.get("grant_hold", &p->grant_hold, {0, 100},
            "Granted work, as a share of the nominal need, below which the scan is held, but never "
            "two in a row.");
  table.get("recover_margin", &p->recover_margin, {1, 100},
            "Factor by which the load must be below its limits for a scan to count as calm [1]. "
            "Larger: later recovery.");
  table.get("recover_after", &p->recover_after, {1, 10000},
            "Calm scans in a row after which the degrade level falls by one.");
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
  sp.get_ms("budget_ms", &c.info.budget, {1, 10000},
            "Deadline of a cycle after its wakeup, and of a scan after its last facet. Work is "
            "left out to keep it.");
  sp.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 10000},
            "Compute time by which a replay delays the output of the cycle that completes a scan.");
  sp.get("source_voxel_m", &c.source_voxel_m, {0.05, 10},
         "Edge of the voxels of which one point each is registered. Smaller: more accurate, more "
         "compute time. It shrinks with those of the rolling map, see [sp.map] voxel_m.");
  sp.get("map_voxel_m", &c.map_voxel_m, {0.02, 10},
         "Edge of the voxels of which one point each is inserted in the rolling map; all other "
         "samples are drawn from these points.");
  sp.get("publish_voxel_m", &c.publish_voxel_m, {0.02, 10},
         "Edge of the voxels of which one point each is published for WM's terrain. It has little "
         "effect below map_voxel_m.");
  sp.get("prior_column_m", &c.prior_scan.column_m, {0.1, 50},
         "Edge of the vertical columns of which the lowest point each is matched to the ground of "
         "the a priori map.");
  sp.get(
      "prior_standing_m", &c.prior_scan.standing_m, {0.05, 20},
      "Height above the lowest point of its column from which a point is above-ground structure.");
  sp.get("prior_point_voxel_m", &c.prior_scan.voxel_m, {0.02, 10},
         "Edge of the voxels of which one point each of the above-ground structure is kept.");
  sp.get("min_facets", &c.min_facets, {0, 1},
         "Smallest share of its facets with which a scan is registered; with fewer it fails.");
  sp.get_ms(
      "facet_timeout_ms", &c.facet_timeout, {1, 1000},
      "Time without a facet after which an incomplete scan is processed with the facets received.");
  sp.get("reseed_after", &c.reseed_after, {1, 1000},
         "Failed registrations in a row after which a new rolling map is started.");
  sp.get("coast_sigma_m", &c.expectation.coast_sigma_m, {0.001, 100},
         "Position error of a prediction by constant velocity or during a silence of the INS, one "
         "standard deviation. Larger: it constrains less.");
  sp.get_deg("coast_sigma_deg", &c.expectation.coast_sigma_rad, {0.01, 170},
             "Attitude error of a prediction by constant velocity or during a silence of the INS, "
             "one standard deviation. Larger: it constrains less.");
  sp.get("prediction_sigma_scale", &c.expectation.sigma_scale, {0.1, 100},
         "Factor on the standard deviation of the pose predicted from WM's state [1]. Larger: the "
         "prediction constrains less.");
  read(sp.table("icp"), &c.icp);
  read(sp.table("map"), &c.map);
  read(sp.table("prior"), &c.prior);
  read(sp.table("initial_localization"), &c.initial_localization);
  read(sp.table("grant"), &c.grant);
  read(sp.table("degrade"), &c.degrade);

  read_start(root, &c);

  if (Outcome read_all = file.finish(tables_but({"ladar", "sp", "start"})); !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::sp
