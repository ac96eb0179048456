#include "modules/bg/bg_config.h"

#include <algorithm>

#include "rcs/node/params/vehicle_tables.h"
#include "rcs/zones/zone_params.h"

namespace rcs::bg {
namespace {

void read(ParamTable table, Shape* p, double* margin_m) {
  table.get("length_m", &p->length_m, {0.5, 20},
            "Length of the vehicle's outline, at most three times width_m.");
  table.get("width_m", &p->width_m, {0.3, 5}, "Width of the vehicle's outline.");
  table.get("max_curvature_1pm", &p->max_curvature_1pm, {0.01, 1},
            "Largest curvature of a planned path and of a drive command. Smaller: wider turns.");
  table.get("curvature_rate", &p->curvature_rate, {0.01, 10},
            "Largest rate at which the steering changes the curvature [1/(m s)]. Smaller: slower "
            "driving where the curvature changes.");
  table.get("margin_m", margin_m, {0, 2},
            "Distance kept from obstacles where the way around is not much longer, see "
            "[bg.weights] within_margin.");
  p->min_margin_m = std::min(p->min_margin_m, *margin_m);
  table.get("min_margin_m", &p->min_margin_m, {0, *margin_m},
            "Distance always kept from obstacles, at most margin_m. Larger: narrower gaps are not "
            "planned through.");
  if (p->length_m > 3.0 * p->width_m) {
    table.fail("length_m", "must not be more than three times width_m");
  }
}

void read(ParamTable table, SearchParams* p, GrantParams* grant) {
  table.get("horizon_m", &p->horizon_m, {5, 200},
            "Path length at which the search ends. Larger: fewer dead ends, more expansions.");
  table.get("arc_m", &p->arc_m, {0.4, 5},
            "Length of the arc of one expansion. Smaller: finer paths, more expansions.");
  table.get("bin_m", &p->bin_m, {0.1, 2},
            "Edge of the position bins; states in the same position and heading bin count as one. "
            "Smaller: finer search, more expansions.");
  table.get("headings", &p->headings, {8, 128},
            "Number of heading bins of a full turn. Larger: finer search, more expansions.");
  table.get(
      "max_expansions", &p->max_expansions, {100, 1'000'000},
      "Largest number of expansions in a planning cycle; it also bounds the memory of the search.");
  table.get("nominal_expansion_ns", &grant->nominal_unit_ns, {1, 1e6},
            "Compute time of an expansion on the vehicle's computer. Larger: fewer expansions are "
            "granted in the same time.");
  table.get("reserve", &grant->reserve, {0, 0.99},
            "Share of the time to the deadline that is not granted as work. Larger: fewer "
            "overruns, more unfinished searches.");
  grant->cap = p->max_expansions;
}

void read(ParamTable table, FollowParams* p) {
  table.get("braking_mps2", &p->braking_mps2, {0.2, 5},
            "Deceleration by which speeds are planned so that the vehicle can stop. Larger: faster "
            "approach to obstacles and ends.");
  table.get("lookahead_s", &p->lookahead_s, {0.1, 5},
            "Look-ahead time of the pure-pursuit steering. Larger: smoother steering that cuts "
            "corners more.");
  table.get("lookahead_min_m", &p->lookahead_min_m, {0.5, 20},
            "Smallest look-ahead distance of the pure-pursuit steering.");
  table.get("latency_s", &p->latency_s, {0, 2},
            "Latency from a command to the response of the wheels, in speed planning and stopping "
            "distance.");
  table.get(
      "firm_mps2", &p->firm_mps2, {0.1, 20},
      "Deceleration up to which the vehicle slows down for an obstacle in its way. For one that "
      "needs more, because it was detected late, BG commands the brake.");
  table.get("keep_cost", &p->keep_cost, {1, 10},
            "Factor on the cost of a new path [1]: the path under way is kept while its rest costs "
            "less. Larger: fewer changes of path.");
  table.get("keep_m", &p->keep_m, {1, 100},
            "Smallest rest of the path under way with which it is kept against a new one.");
  table.get("max_lateral_deviation_m", &p->max_lateral_deviation_m, {0.1, 10},
            "Largest lateral deviation from the path; beyond it the path is dropped and a new one "
            "is needed.");
}

void read(ParamTable table, DecideParams* p) {
  table.get_ms("nav_silence_ms", &p->nav_silence, {50, 5000},
               "Silence of WM's navigation state after which the vehicle brakes (WM_SILENT).");
  table.get_ms("nav_still_ms", &p->nav_still, {50, 5000},
               "Time without change of the pose's sensor time after which the vehicle brakes "
               "(POSE_FROZEN).");
  table.get_ms(
      "integrity_silence_ms", &p->integrity_silence, {200, 10000},
      "Silence of WM's integrity message after which the vehicle brakes (INTEGRITY_SILENT).");
  table.get_ms("ins_loss_ms", &p->ins_loss, {100, 10000},
               "Age of the newest INS sample in WM after which the vehicle stops (INS_LOST).");
  table.get_ms(
      "ladar_loss_ms", &p->ladar_loss, {100, 10000},
      "Age of the newest accepted registration in WM after which the vehicle stops (LADAR_LOST), "
      "or brakes if GPS is lost, too.");
  table.get_ms(
      "gps_loss_ms", &p->gps_loss, {100, 60000},
      "Age of the newest accepted fix in WM after which GPS counts as lost; the vehicle drives on "
      "by LADAR (DRIVING_NO_GPS).");
  table.get_ms("map_loss_ms", &p->map_loss, {100, 10000},
               "Age of the newest scan in the terrain after which the vehicle stops (MAP_OLD).");
  table.get_ms("patience_ms", &p->patience, {1000, 600000},
               "Time without a path after which the command fails (NO_PATH).");
  table.get("rest_mps", &p->rest_mps, {0.01, 1},
            "Speed below which the vehicle counts as at rest.");
}

void read(ParamTable table, SightParams* p) {
  table.get("height_m", &p->height_m, {0.2, 5}, "Height of the LADAR above level ground.");
  table.get_deg("lowest_deg", &p->lowest_rad, {2, 60},
                "Angle of the lowest ray of the LADAR below the horizon. Ground that this ray "
                "should meet and that is not seen is hidden by an edge: an obstacle.");
  table.get("ahead_m", &p->ahead_m, {-5, 5},
            "Distance of the LADAR before the origin of the vehicle frame.");
  table.get(
      "far_m", &p->far_m, {0, 40},
      "Distance up to which unseen ground counts as hidden: up to here the rows of the LADAR must "
      "meet level ground closer than about a cell of the terrain (0.4 m). Larger: drops are "
      "noticed earlier, crests are refused earlier. 0: no ground counts as hidden, and drops are "
      "not noticed.");
  table.get_deg("half_angle_deg", &p->half_angle_rad, {1, 180},
                "Angle to either side within which the LADAR sees the ground.");
}

void read(ParamTable table, vj::Weights* p) {
  table.get("slope", &p->slope, {0, 100},
            "Cost added per metre at max_slope_deg, falling with the square of the slope [1]. "
            "Larger: slopes are avoided more.");
  table.get("roughness", &p->roughness, {0, 100},
            "Cost added per metre at max_roughness_m, falling with the square of the roughness "
            "[1]. Larger: rough ground is avoided more.");
  table.get(
      "roll", &p->roll, {0, 100},
      "Cost added per metre at max_roll_deg, falling with the square of the roll [1]. Larger: "
      "the vehicle drives up and down slopes rather than along them.");
  table.get("step", &p->step, {0, 100},
            "Cost added per metre at max_step_m, falling with the square of the step [1]. Larger: "
            "steps are avoided more.");
  table.get("unknown", &p->unknown, {0, 100},
            "Cost added per metre of unknown ground [1]. Larger: unseen ground is avoided more.");
  table.get("vegetation", &p->vegetation, {0, 100},
            "Cost added per metre through tall vegetation that gives way [1]. Larger: it is "
            "avoided more.");
  table.get("off_route", &p->off_route, {0, 100},
            "Cost added per metre for each metre of distance from the way that the vehicle drives "
            "back on, up to 2 m [1/m].");
  table.get("nearness", &p->nearness, {0, 100},
            "Cost added per metre in contact with an obstacle, falling to zero at near_m [1]. "
            "Larger: obstacles are passed at a larger distance.");
  table.get("within_margin", &p->within_margin, {0, 100},
            "Cost added per metre nearer to an obstacle than [bg.shape] margin_m [1]. Larger: "
            "longer ways around narrow gaps.");
  table.get("near_m", &p->near_m, {0.1, 20},
            "Distance from obstacles beyond which they affect neither cost nor speed.");
  table.get_deg(
      "max_slope_deg", &p->max_slope_rad, {3, 69},
      "Slope above which ground is an obstacle; also the slope of full cost and of rough_mps.");
  table.get_deg("max_roll_deg", &p->max_roll_rad, {3, 69},
                "Roll of the ground below the vehicle above which no path leads; also that of full "
                "cost. Lower than what tips the vehicle, by what single stones and the suspension "
                "add.");
  table.get("max_roughness_m", &p->max_roughness_m, {0.01, 1},
            "Roughness (rms about the plane) of full cost and of rough_mps. Rougher ground is not "
            "forbidden.");
  table.get("max_step_m", &p->max_step_m, {0.05, 1},
            "Step of full cost. Higher steps are not forbidden by it; obstacles are classified in "
            "[wm.terrain].");
  table.get("reverse", &p->reverse, {1, 100},
            "Cost of a metre backwards, in metres ahead [1]. Larger: less reversing.");
  table.get("turn_back", &p->turn_back, {0, 100},
            "Cost of a change of direction [m]. Larger: fewer changes of direction.");
}

void read(ParamTable table, vj::SpeedParams* p) {
  table.get("smooth_mps", &p->smooth_mps, {0.1, 30},
            "Speed on level, smooth ground away from obstacles.");
  table.get("rough_mps", &p->rough_mps, {0.1, 30},
            "Speed on the steepest or roughest ground (max_slope_deg, max_roughness_m).");
  table.get("unknown_mps", &p->unknown_mps, {0.1, 30}, "Speed on ground that has not been seen.");
  table.get("vegetation_mps", &p->vegetation_mps, {0.1, 30},
            "Speed through tall vegetation that gives way; it may hide a rock.");
  table.get("near_mps", &p->near_mps, {0.1, 30},
            "Speed in contact with an obstacle, and the largest speed backwards.");
  table.get(
      "sight_mps", &p->sight_mps, {0.1, 30},
      "Largest speed but on mapped roads. Larger: the vehicle does not stop before ditches "
      "and drops, which are seen from a few metres only. 5 m/s is for ditches from 0.8 m width.");
  table.get("lateral_mps2", &p->lateral_mps2, {0.1, 10},
            "Lateral acceleration that limits the speed in turns. Larger: faster turns.");
  table.get("full_speed_sigma_m", &p->full_speed_sigma_m, {0.01, 100},
            "Horizontal standard deviation of the world pose up to which the speed is not reduced; "
            "for waypoints in frame world.");
  table.get("stop_sigma_m", &p->stop_sigma_m, {0.1, 1000},
            "Horizontal standard deviation of the world pose from which the vehicle does not drive "
            "to waypoints in frame world.");
  table.get("min_speed_share", &p->min_speed_share, {0.01, 1},
            "Share of the speed that is left just below stop_sigma_m and the alert limits.");
  table.get(
      "alert_limit_horizontal_m", &p->alert_limit_horizontal_m, {0.5, 1000},
      "Horizontal protection level, in the frame of the task, from which the vehicle does not "
      "drive to a waypoint; it slows down from half of it.");
  table.get("alert_limit_vertical_m", &p->alert_limit_vertical_m, {0.5, 1000},
            "Vertical protection level, in the frame of the task, from which the vehicle does not "
            "drive to a waypoint; it slows down from half of it.");
  if (p->stop_sigma_m <= p->full_speed_sigma_m) {
    table.fail("stop_sigma_m", "must be more than full_speed_sigma_m");
  }
}

}  // namespace

Result<BgConfig> load_bg_config(const ParamFile& file) {
  BgConfig c;
  ParamTable bg = file.root().table("bg");
  bg.get_ms("budget_ms", &c.info.budget, {1, 1000},
            "Deadline of a cycle after its wakeup; a cycle that ends later is an overrun. It "
            "bounds the planning work.");
  bg.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000},
            "Compute time by which a replay delays the output of a cycle that does not plan.");
  bg.get_ms("period_ms", &c.period, {10, 500}, "Period of the drive commands.");
  bg.get_ms(
      "plan_period_ms", &c.plan_period, {50, 5000},
      "Period of the path planning. Smaller: earlier reaction to new terrain, more compute time.");
  bg.get_ms("plan_compute_ms", &c.plan_compute, {0, 1000},
            "Compute time by which a replay delays the output of a cycle that plans.");
  bg.get_ms("drive_valid_ms", &c.drive_valid, {50, 2000},
            "Validity of a drive command; the vehicle stops by itself when it expires. More than "
            "period_ms.");
  bg.get("max_speed_mps", &c.max_speed_mps, {0.1, 30}, "Largest speed of any command.");
  bg.get("north_mps", &c.north_mps, {0.1, 30},
         "Largest speed while the vehicle drives ahead to initialize its heading "
         "(INITIALIZING_HEADING).");
  bg.get("north_m", &c.north_m, {5, 500},
         "Largest distance straight ahead to initialize the heading (INITIALIZING_HEADING).");
  bg.get("near_goal_m", &c.near_goal_m, {0, 100},
         "Increase of a waypoint's radius where no path leads into it, so that the vehicle drives "
         "near it and sees more.");
  bg.get("accel_mps2", &c.accel_mps2, {0.1, 10},
         "Acceleration limit in every drive command, for speeding up.");
  bg.get(
      "release_authorities", &c.release_authorities,
      "Issuers of commands (operator: `rcs go`; gateway: DDS) that may release the emergency "
      "stops of other issuers. A stop of an unknown issuer can only be released by one of them.");
  read(bg.table("shape"), &c.shape, &c.weights.margin_m);
  read(bg.table("search"), &c.search, &c.grant);
  read(bg.table("follow"), &c.follow);
  read(bg.table("decide"), &c.decide);
  read(bg.table("sight"), &c.sight);
  read(bg.table("weights"), &c.weights);
  read(bg.table("speeds"), &c.speeds);
  c.zones = read_zones(file);
  if (c.drive_valid <= c.period) bg.fail("drive_valid_ms", "must be more than period_ms");

  if (Outcome read_all = file.finish(tables_but({"bg"})); !read_all) return read_all.error();
  return c;
}

}  // namespace rcs::bg
