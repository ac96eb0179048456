#include "modules/wm/wm_config.h"

#include <string>

#include "rcs/node/params/ladar_mount.h"
#include "rcs/node/params/vehicle_tables.h"
#include "rcs/zones/zone_params.h"

namespace rcs::wm {
namespace {

// Units of data sheets.
constexpr double kDegPerSqrtHour = kPi / 180.0 / 60.0;
constexpr double kDegPerHour = kPi / 180.0 / 3600.0;
constexpr double kPerSqrtHour = 1.0 / 60.0;
constexpr double kMilliG = 9.80665e-3;

void read_ins(ParamTable table, ProcessNoise* p) {
  std::string grade = "tactical";
  table.get("grade", &grade, {"tactical", "industrial", "consumer"},
            "Grade of the INS. It sets the defaults of the random walk, bias and turn-on keys of "
            "this table from typical data sheets.");
  *p = ins_grade(grade);
  table.get_scaled("angle_random_walk_deg_per_sqrt_h", kDegPerSqrtHour, &p->angle_random_walk,
                   {1e-5, 100},
                   "Angle random walk of the gyros. Larger: the attitude becomes uncertain faster "
                   "between corrections.");
  table.get_scaled("velocity_random_walk_mps_per_sqrt_h", kPerSqrtHour, &p->velocity_random_walk,
                   {1e-5, 60},
                   "Velocity random walk of the accelerometers. Larger: velocity and position "
                   "become uncertain faster between corrections.");
  table.get_scaled("gyro_instability_deg_per_h", kDegPerHour, &p->gyro_instability, {1e-4, 1e4},
                   "In-run bias instability of the gyros: standard deviation of the random walk of "
                   "their bias within bias_time_s.");
  table.get_scaled("accel_instability_mg", kMilliG, &p->accel_instability, {1e-4, 100},
                   "In-run bias instability of the accelerometers: standard deviation of the "
                   "random walk of their bias within bias_time_s.");
  table.get_scaled("gyro_turn_on_deg_per_h", kDegPerHour, &p->gyro_turn_on, {1e-4, 2e4},
                   "Turn-on bias of the gyros: standard deviation of their bias at the start.");
  table.get_scaled(
      "accel_turn_on_mg", kMilliG, &p->accel_turn_on, {1e-4, 100},
      "Turn-on bias of the accelerometers: standard deviation of their bias at the start.");
  table.get("bias_time_s", &p->bias_time_s, {1, 1e5},
            "Time in which gyro and accelerometer biases wander by their instability. Larger: the "
            "bias estimates change more slowly.");
  table.get("scale_and_misalignment", &p->scale_and_misalignment, {0, 0.1},
            "Scale-factor and axis-misalignment error of the INS [1], one standard deviation. "
            "Larger: the INS weighs less in turns and under acceleration.");
  table.get_deg("mount_sigma_deg", &p->mount_sigma_rad, {0, 10},
                "Standard deviation of the INS mounting angle about each vehicle axis. It is "
                "constant and adds to the published attitude covariance.");
  table.get("motion_time_s", &p->motion_time_s, {0.1, 60},
            "Low-pass time constant of the yaw rate and specific force that scale-factor noise "
            "follows; motion that reverses faster leaves no error.");
}

void read_gps(ParamTable table, GpsParams* p, DriveNoise* drive) {
  table.get("lever_m", &p->lever_m, {-20, 20},
            "Position of the GPS antenna in the vehicle frame (x ahead, y left, z up).");
  table.get("correlated", &p->correlated, {0, 0.999},
            "Share of the reported standard deviation that is time-correlated (Gauss-Markov, "
            "tau_s); the rest is white noise. Larger: consecutive fixes average out less.");
  table.get("sigma_floor_m", &p->sigma_floor_m, {1e-3, 10},
            "Smallest standard deviation with which a fix is fused, whatever the receiver reports. "
            "Larger: GPS weighs less.");
  table.get("sigma_time_s", &p->sigma_time_s, {0, 0.5},
            "Standard deviation of the receiver clock against the vehicle clock. Larger: fixes "
            "weigh less along the motion.");
  table.get(
      "tau_s", &drive->gps_tau_s, {0.1, 1e5},
      "Correlation time of the GPS position error. Larger: averaging over many fixes gains less.");
}

void read_odometry(ParamTable table, OdometryParams* p, DriveNoise* drive) {
  table.get("sigma_floor_mps", &p->sigma_floor_mps, {1e-3, 10},
            "Smallest standard deviation with which a wheel speed is fused, whatever the message "
            "reports. Larger: odometry weighs less.");
  table.get("slip", &p->slip, {0, 1},
            "Standard deviation of the longitudinal wheel slip as a share of the speed, "
            "time-correlated over correlation_s. Larger: odometry weighs less.");
  table.get("lateral_mps", &p->lateral_mps, {1e-3, 10},
            "Standard deviation of the lateral velocity in the non-holonomic constraint. Smaller: "
            "sideways drift is suppressed more strongly.");
  table.get("vertical_mps", &p->vertical_mps, {1e-3, 10},
            "Standard deviation of the vertical body velocity in the non-holonomic constraint on "
            "smooth ground. Smaller: vertical drift is suppressed more strongly.");
  table.get("heave_hz", &p->heave_hz, {0.1, 100},
            "Natural frequency of the body on its suspension; it converts the measured shaking "
            "into vertical velocity noise. Larger: tighter constraint on rough ground.");
  table.get("side_slip", &p->side_slip, {0, 1},
            "Standard deviation of lateral and vertical slip in the non-holonomic constraint as a "
            "share of the speed, time-correlated over correlation_s.");
  table.get("scale_sigma", &p->scale_sigma, {1e-5, 0.5},
            "Initial standard deviation of the wheel scale factor [1]; WM estimates the factor.");
  table.get("climb_slip", &p->climb_slip, {0, 1},
            "Initial standard deviation of the wheel slip per sine of the climb angle [1]; WM "
            "estimates it.");
  table.get("correlation_s", &drive->slip_correlation_s, {0.01, 1e5},
            "Correlation time of the longitudinal, lateral and vertical slip. Larger: averaging "
            "over many samples gains less.");
  table.get("constrained", &p->constrained,
            "Applies the non-holonomic constraint (the vehicle moves along its own axis), also "
            "while no odometry is received.");
  table.get("zero_velocity", &p->zero_velocity,
            "Fuses zero-velocity updates at standstill; false: standstill is used for the "
            "alignment alone.");
}

void read_motion(ParamTable table, MotionNoise* p) {
  table.get("acceleration", &p->acceleration, {1e-3, 100},
            "Acceleration noise of the motion model without INS [m/s^2/sqrt(Hz)]. Larger: the "
            "velocity becomes uncertain faster.");
  table.get("angular_acceleration", &p->angular_acceleration, {1e-3, 100},
            "Roll and pitch acceleration noise of the motion model without INS [rad/s^2/sqrt(Hz)]. "
            "Larger: the tilt becomes uncertain faster.");
  table.get("yaw_acceleration", &p->yaw_acceleration, {1e-3, 100},
            "Yaw acceleration noise of the motion model without INS [rad/s^2/sqrt(Hz)]. Larger: "
            "the heading becomes uncertain faster.");
  table.get("tilt_time_s", &p->tilt_time_s, {0.01, 100},
            "Correlation time of the roll and pitch rates in the motion model without INS; a body "
            "on its suspension returns within tenths of a second.");
  table.get("yaw_time_s", &p->yaw_time_s, {0.01, 100},
            "Correlation time of the yaw rate in the motion model without INS; a turn lasts for "
            "seconds.");
  table.get("rate_sigma", &p->rate_sigma, {1e-4, 10},
            "Smallest standard deviation of the yaw rate when the INS falls silent, and of all "
            "body rates at a start without INS [rad/s].");
}

void read_drive(ParamTable table, DriveNoise* p) {
  table.get("rolling_position", &p->rolling_position, {0, 1},
            "Position drift of SP's rolling map with the distance driven [m/sqrt(m)]. Larger: "
            "LADAR dead reckoning becomes uncertain faster.");
  table.get("rolling_angle", &p->rolling_angle, {0, 0.1},
            "Attitude drift of SP's rolling map with the distance driven [rad/sqrt(m)]. Larger: "
            "LADAR dead reckoning becomes uncertain faster.");
  table.get("mount_angle", &p->mount_angle, {0, 0.01},
            "Random walk of the LADAR mounting angles with the distance driven [rad/sqrt(m)]. "
            "Larger: the misalignment estimate changes faster.");
  table.get("map_sigma_m", &p->map_sigma_m, {1e-3, 100},
            "Standard deviation of the a priori map's bias where the survey states none. Larger: "
            "the map weighs less.");
  table.get("map_length_m", &p->map_length_m, {1, 1e5},
            "Correlation length of the a priori map's bias where the survey states none. Larger: "
            "driving on averages less of the bias out.");
  table.get("wheel_scale", &p->wheel_scale, {0, 0.1},
            "Random walk of the wheel scale factor with the distance driven [1/sqrt(m)]. Larger: "
            "the estimate changes faster.");
}

void read_match(ParamTable* table, RegistrationParams* p) {
  table->get("inflation", &p->inflation, {1, 1000},
             "Factor on the covariance of a match [1], because neighbouring residuals share their "
             "errors. Larger: matches weigh less.");
  table->get("sigma_floor_m", &p->sigma_floor_m, {0, 1},
             "Standard deviation added to a match along each translation axis. Larger: matches "
             "weigh less in position.");
  table->get("sigma_floor_rad", &p->sigma_floor_rad, {0, 0.1},
             "Standard deviation added to a match about each rotation axis. Larger: matches weigh "
             "less in attitude.");
  table->get("sigma_time_s", &p->sigma_time_s, {0, 0.5},
             "Standard deviation of the LADAR clock against the vehicle clock. Larger: matches "
             "weigh less along the motion.");
  table->get("arm_m", &p->arm_m, {0.1, 100},
             "Lever arm that makes rotations comparable to translations when a match is split into "
             "observed and unobserved directions.");
  table->get("observed_sigma_m", &p->observed_sigma_m, {1e-3, 100},
             "Directions of a match with a larger standard deviation are not fused (rotations "
             "count at arm_m). Smaller: fewer directions are fused.");
}

void read_rolling(ParamTable table, RollingParams* p) {
  read_match(&table, &p->match);
  table.get("refused_until_reset", &p->refused_until_reset, {2, 1000},
            "Matches rejected in a row after which WM re-initializes its pose of the rolling map "
            "from a match that observes all directions.");
  table.get("inherited", &p->inherited, {0, 1},
            "Share of a scan's covariance that the rolling map inherits per metre driven [1/m]. "
            "Larger: LADAR dead reckoning becomes uncertain faster.");
  table.get("correlation_m", &p->correlation_m, {0.01, 100},
            "Distance between scans below which a match counts in proportion to it: scans closer "
            "together share their error. Larger: matches weigh less at low speed.");
}

void read_prior(ParamTable table, PriorMapParams* p) {
  read_match(&table, &p->match);
  table.get("mount_sigma_m", &p->mount_sigma_m, {0, 1},
            "Standard deviation of the position of the LADAR mount, added to each match to the a "
            "priori map.");
  table.get("heading_sigma_rad", &p->heading_sigma_rad, {1e-4, 3.2},
            "Largest heading standard deviation with which the first match to the a priori map is "
            "fused.");
  table.get("correlation_m", &p->correlation_m, {0.01, 1e4},
            "Distance over which scans share the map's errors; matches closer together are fused "
            "with a proportionally smaller weight.");
  table.get("bias_margin", &p->bias_margin, {1, 100},
            "Factor on the systematic error that the survey states [1]. Larger: the a priori map "
            "weighs less.");
  table.get("nis_window_m", &p->nis_window_m, {1, 1e4},
            "Distance constant of the low-passed normalized innovation (NIS) of a map tile. "
            "Larger: a bad tile loses weight and is excluded more slowly.");
}

void read_stillness(ParamTable table, StillnessParams* p) {
  table.get("window_s", &p->window_s, {0.05, 10},
            "Time constant of the running mean and variance of INS rates and specific force for "
            "standstill detection.");
  table.get("rate_radps", &p->rate_radps, {1e-5, 1},
            "Standard deviation of the angular rate below which the INS counts as at rest. Larger: "
            "standstill is detected more easily.");
  table.get("accel_mps2", &p->accel_mps2, {1e-4, 10},
            "Standard deviation of the specific force below which the INS counts as at rest. "
            "Larger: standstill is detected more easily.");
  table.get("speed_mps", &p->speed_mps, {1e-3, 10},
            "Speed of the odometry, else of the filter, below which a quiet INS means standstill; "
            "slower motion does not count as distance driven.");
  table.get("sigma_mps", &p->sigma_mps, {1e-4, 1},
            "Standard deviation of the zero-velocity measurement. Smaller: the velocity is held "
            "closer to zero at standstill.");
  table.get_ms("period_ms", &p->period, {10, 10000},
               "Shortest interval between two zero-velocity updates.");
}

void read_align(ParamTable table, AlignParams* p) {
  table.get_ms("level_time_ms", &p->level_time, {100, 60000},
               "Duration of standstill over which the INS is averaged for levelling. Larger: a "
               "later but more accurate start.");
  table.get_ms("patience_ms", &p->patience, {100, 600000},
               "Time since the first INS sample after which the filter levels in motion, if the "
               "vehicle does not stand still.");
  table.get("level_sigma_mps2", &p->level_sigma_mps2, {1e-4, 5},
            "Standard deviation of the mean specific force as a measurement of gravity at rest. "
            "Larger: a less certain initial tilt.");
  table.get("moving_level_sigma_mps2", &p->moving_level_sigma_mps2, {1e-3, 5},
            "Standard deviation of the mean specific force as a measurement of gravity in motion. "
            "Larger: a less certain initial tilt.");
  table.get(
      "tilt_sigma_rad", &p->tilt_sigma_rad, {1e-4, 0.8},
      "Initial standard deviation of roll and pitch before levelling, and of a start without INS.");
  table.get("speed_sigma_mps", &p->speed_sigma_mps, {1e-3, 100},
            "Initial standard deviation of the velocity, unless the vehicle starts at rest.");
  table.get("baseline_m", &p->baseline_m, {0.5, 1000},
            "Shortest baseline of GPS fixes from which the heading is found; also the largest "
            "position standard deviation of a start by the a priori map.");
  table.get("heading_sigma_rad", &p->heading_sigma_rad, {1e-3, 0.5},
            "Largest standard deviation with which an initial heading is accepted. Larger: an "
            "earlier but less accurate start.");
  table.get("course_speed_mps", &p->course_speed_mps, {0.5, 100},
            "GPS speed above which the course over ground of a fix initializes the heading.");
}

void read_history(ParamTable table, HistoryParams* p) {
  table.get("capacity", &p->capacity, {64, 100000},
            "Number of inputs kept for late data. It should hold all inputs of lag_ms; otherwise "
            "late data is rejected sooner.");
  table.get_ms("lag_ms", &p->lag, {10, 10000},
               "Age up to which late data is fused at its own time. Larger: later data is "
               "accepted, and faults are detected later.");
  table.get_ms("jump_ms", &p->jump, {100, 60000},
               "Time by which a stamp may be ahead of the newest input; a stamp further ahead is "
               "rejected as a clock fault. Not less than lag_ms.");
  table.get_ms("bridge_ms", &p->bridge, {1, 1000},
               "Longest gap of the INS that is bridged by extending the next sample over it; a "
               "longer gap is predicted without INS.");
  table.get_ms("ins_timeout_ms", &p->ins_timeout, {10, 10000},
               "Age of the newest INS sample after which the INS counts as silent and the filter "
               "predicts without it.");
  table.get("clock_step_count", &p->clock_step_count, {2, 10000},
            "Inputs in a row with a stamp out of range after which a step of all clocks is assumed "
            "and the filter moves to the new time.");
  if (p->jump < p->lag) table.fail("jump_ms", "must not be less than lag_ms");
}

void read_local(ParamTable table, LocalFrameParams* p) {
  table.get("slew_mps", &p->slew_mps, {1e-3, 10},
            "Largest speed at which LADAR corrections shift the published local pose. Larger: "
            "faster correction, larger steps.");
  table.get("slew_radps", &p->slew_radps, {1e-4, 10},
            "Largest rate at which LADAR corrections turn the published local pose. Larger: faster "
            "correction, larger steps.");
}

void read_modes(ParamTable table, ModeParams* p) {
  table.get_ms(
      "gps_timeout_ms", &p->gps_timeout, {100, 60000},
      "Age of the newest fix after which the navigation mode and the source status report no GPS.");
  table.get_ms("rolling_timeout_ms", &p->rolling_timeout, {100, 60000},
               "Age of the newest accepted match to the rolling map after which the navigation "
               "mode and the source status report no LADAR.");
  table.get_ms("input_timeout_ms", &p->input_timeout, {0, 60000},
               "Time for which all inputs may exceed their silence limits before the pose is "
               "published as invalid.");
  table.get("reset_m", &p->reset_m, {0.001, 100},
            "Position step of the world pose in one update above which the step is counted and "
            "published as a reset.");
  table.get("reset_rad", &p->reset_rad, {1e-4, 3},
            "Rotation of the world pose in one update above which the step is counted and "
            "published as a reset.");
}

void read_terrain(ParamTable table, WmConfig* c) {
  TerrainParams& p = c->terrain;
  table.get("cell_m", &p.cell_m, {0.1, 2},
            "Edge of a cell of the published terrain. Heights are kept by quarter cell.");
  table.get("size", &p.size, {64, 1024},
            "Cells along each side of the grid that moves with the vehicle, a power of two. "
            "Larger: terrain is kept farther away.");
  table.get("patch", &p.patch, {32, 512},
            "Cells along each side of the published map patch, at most half of size.");
  table.get(
      "ahead_m", &p.ahead_m, {0, 100},
      "Distance from the vehicle to the centre of the published patch, ahead of the vehicle.");
  table.get("overhang_m", &p.overhang_m, {0.5, 10},
            "Height above the ground from which points are ignored as overhangs; it must exceed "
            "the height of the vehicle.");
  table.get("solid_m", &p.solid_m, {0.05, 2},
            "Height above the plane of its neighbourhood from which ground is a solid obstacle "
            "such as a rock. Smaller: more obstacles.");
  table.get("obstacle_m", &p.obstacle_m, {0.05, 2},
            "Height above the ground from which points are evidence of an obstacle. It should "
            "exceed the grass.");
  table.get("ledge_m", &p.ledge_m, {0.05, 2},
            "Height of an edge in the ground, beyond the slope before and after it, from which it "
            "is an obstacle: ledges, drops, sides of ditches. Lower than what the vehicle can "
            "drive over, by the error of the heights.");
  table.get("accurate_m", &p.accurate_m, {0, 200},
            "Range within which the lowest points of three scans replace those of scans at longer "
            "range, where errors of position and attitude assign ground to the cells of rocks. "
            "Larger: rocks are detected earlier, and with less certainty. 0: all scans count "
            "alike.");
  table.get(
      "side_m", &p.side_m, {0, 1},
      "Height above the plane of its neighbourhood from which ground next to an obstacle is a "
      "part of it, such as the side of a rock. 0: disabled.");
  table.get("evidence", &p.evidence, {0.5, 10},
            "Net number of scans with tall points from which a cell is an obstacle. Larger: fewer "
            "false obstacles, later detection.");
  table.get("near_m", &p.near_m, {0, 20},
            "Range below which returns are no evidence of the ground, because the lowest LADAR "
            "rays are above level ground there.");
  table.get("near_start_m", &p.near_start_m, {0, 20},
            "Replaces near_m while the vehicle is near its start, where the ground ahead has not "
            "been seen from farther away.");
  table.get("max_range_m", &p.max_range_m, {5, 300},
            "Largest range of the points used for the terrain. Larger: earlier view, but pitch "
            "errors lift distant points.");
  table.get("edge_range_m", &p.edge_range_m, {0, 40},
            "Range up to which ground that an edge hides from the LADAR, in a ditch or below a "
            "drop, is found and is an obstacle until it is seen. Its rows must meet level ground "
            "there closer than about 0.6 m; with sparser rows edges are assumed on rugged ground. "
            "0: off, and ditches are not noticed.");
  table.get("edge_deficit_m", &p.edge.deficit_m, {0.02, 2},
            "Ground behind unseen ground is behind an edge if it is lower by more than this, plus "
            "three standard deviations of the extrapolation, than the extrapolated ground before "
            "it. Smaller: ditches are found earlier, and more rough ground is an obstacle.");
  table.get("vegetation_m", &p.vegetation_m, {0, 2},
            "What stands on the ground up to this height and lets more than half of the rays "
            "through is vegetation that gives way to the vehicle. 0: everything above obstacle_m "
            "is an obstacle.");
  table.get("upright_m", &p.upright_m, {0, 3},
            "What stands higher than this, seen by at least four rays of one scan, is an obstacle "
            "at once, and is removed when rays pass where it was: people and vehicles. It should "
            "exceed vegetation in which rocks are hidden. 0: off.");
  table.get("motion_s", &p.motion_s, {0, 10},
            "Ground that a person or a vehicle which moves reaches within this time, at its "
            "velocity, counts as an obstacle; needs upright_m. 0: off.");
  table.get_ms("period_ms", &c->map_period, {50, 10000}, "Period of the published map patch.");
  if ((p.size & (p.size - 1)) != 0) table.fail("size", "must be a power of two");
  if (2 * p.patch > p.size) table.fail("patch", "must not be more than half of size");
}

void read_path_uncertainty(ParamTable table, PathUncertaintyParams* p) {
  table.get("radius_m", &p->radius_m, {5, 200},
            "Radius of the ground that a scan sees, and distance between the map matches assumed "
            "along a path.");
  table.get("drift", &p->drift, {1e-6, 1},
            "Dead-reckoning error per metre driven besides the heading error [1], one standard "
            "deviation. Larger: a more conservative prediction.");
}

void read_fde(ParamTable table, FaultDetectionParams* p) {
  table.get_ms(
      "silence_ms", &p->silence, {1000, 600000},
      "Gap without fixes after which GPS is quarantined when it returns and must be readmitted.");
  table.get("refused", &p->refused, {2, 1000},
            "Fixes rejected in a row by the innovation gate after which GPS is not fused. Larger: "
            "later.");
  table.get("agreeing", &p->agreeing, {2, 6},
            "Number of the newest six fixes that must agree with the filter in position and "
            "velocity before GPS is readmitted.");
  table.get_ms("agreeing_for_ms", &p->agreeing_for, {0, 60000},
               "Time for which fixes must agree without interruption before GPS is readmitted.");
  table.get_ms("persistent_ms", &p->persistent, {10000, 600000},
               "Time for which fixes must contradict the filter but not one another before they "
               "are accepted and replace its position.");
  table.get("persistent_m", &p->persistent_m, {10, 10000},
            "Distance driven for which fixes must contradict the filter but not one another before "
            "they are accepted and replace its position.");
  table.get_ms("probation_ms", &p->probation, {1000, 60000},
               "Time after its readmission for which a source is reported as on probation; if GPS "
               "is excluded again within it, the readmission is revoked.");
  table.get_ms("branch_ms", &p->branch, {2000, 60000},
               "Age at which the sub-filters are branched again from the main filter. Larger: "
               "slower faults are detected, with a wider test.");
  table.get("refuted_fixes", &p->refuted_fixes, {1, 100},
            "Fixes in a row beyond the limit of the sub-filter test after which GPS, or the a "
            "priori map that contradicts the fixes, is excluded.");
  table.get_ms("ladar_refuted_ms", &p->ladar_refuted, {100, 60000},
               "Time for which a test of the LADAR, the INS or the a priori map must exceed its "
               "limit before the source is excluded.");
  table.get("matches", &p->matches, {2, 1000},
            "Number of accepted matches after which an excluded LADAR can be readmitted.");
  table.get("false_alarm", &p->false_alarm, {1e-12, 1e-3},
            "False-alarm probability of the sub-filter tests. Smaller: fewer false exclusions, "
            "larger minimum detectable error.");
  table.get("floor_m", &p->floor_m, {0.01, 10},
            "Standard deviation added to the position difference of two filters in the LADAR and "
            "map tests, for errors that are not modelled.");
  table.get("floor_share", &p->floor_share, {0, 0.1},
            "Position error of the sub-filter without GPS per metre driven that its covariance "
            "does not contain [1], one standard deviation.");
  table.get("floor_mps", &p->floor_mps, {0, 1},
            "Velocity error of a filter that its covariance does not contain, one standard "
            "deviation, in the tests of the GPS velocity.");
  table.get("attitude_sigma_rad", &p->attitude_sigma_rad, {1e-3, 1},
            "Largest attitude standard deviation (without INS: of the heading) with which "
            "sub-filters are branched; at rest the heading may be known to 0.02 rad only. Larger: "
            "earlier but weaker fault detection.");
  table.get("cusum", &p->cusum, {3, 1000},
            "Limit of the cumulative sum of excess GPS velocity, in standard deviations, above "
            "which GPS is excluded. Larger: fewer false exclusions, later detection.");
}

void read_integrity(ParamTable table, IntegrityParams* p) {
  table.get("limit_horizontal_m", &p->limit_horizontal_m, {0.1, 1000},
            "Horizontal alert limit: an alert is raised while the horizontal protection level "
            "exceeds it.");
  table.get(
      "limit_vertical_m", &p->limit_vertical_m, {0.1, 1000},
      "Vertical alert limit: an alert is raised while the vertical protection level exceeds it.");
}

std::optional<Geodetic> read_datum(ParamTable world) {
  const bool given =
      world.has("datum_lat_deg") || world.has("datum_lon_deg") || world.has("datum_height_m");
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
  if (!given) return std::nullopt;
  for (const std::string_view key : {"datum_lat_deg", "datum_lon_deg", "datum_height_m"}) {
    if (!world.has(key)) world.fail(key, "is missing: a datum is given whole or not at all");
  }
  return datum;
}

}  // namespace

ProcessNoise ins_grade(std::string_view grade) {
  // In the units of data sheets: deg/sqrt(h), m/s/sqrt(h), deg/h, mg, s, deg/h, mg.
  const auto figures = [](double angle_walk, double velocity_walk, double gyro_instability,
                          double accel_instability, double bias_time_s, double gyro_turn_on,
                          double accel_turn_on) {
    ProcessNoise p;
    p.angle_random_walk = angle_walk * kDegPerSqrtHour;
    p.velocity_random_walk = velocity_walk * kPerSqrtHour;
    p.gyro_instability = gyro_instability * kDegPerHour;
    p.accel_instability = accel_instability * kMilliG;
    p.bias_time_s = bias_time_s;
    p.gyro_turn_on = gyro_turn_on * kDegPerHour;
    p.accel_turn_on = accel_turn_on * kMilliG;
    return p;
  };
  if (grade == "industrial") return figures(0.3, 0.05, 8.5, 0.14, 200.0, 100.0, 3.0);
  if (grade == "consumer") return figures(0.6, 0.18, 42.0, 0.42, 100.0, 1000.0, 20.0);
  return {};
}

Result<WmConfig> load_wm_config(const ParamFile& file) {
  WmConfig c;
  WmParams& p = c.params;
  ParamTable root = file.root();
  c.datum = read_datum(root.table("world"));
  c.prior_terrain = read_prior_terrain(file);
  read_zones_key(file);  // of BG; WM checks the keys of [world]
  read_gps(root.table("gps"), &p.gps, &p.drive);
  read_ins(root.table("ins"), &p.ins);
  read_odometry(root.table("odometry"), &p.odometry, &p.drive);

  ParamTable wm = root.table("wm");
  wm.get_ms("budget_ms", &c.info.budget, {1, 1000},
            "Deadline of a cycle after its wakeup; a cycle that ends later is an overrun.");
  wm.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000},
            "Compute time by which a replay delays the output of a cycle.");
  wm.get_ms("period_ms", &c.period, {5, 1000}, "Period of the published navigation state.");
  wm.get("false_alarm", &p.false_alarm, {1e-9, 0.1},
         "Share of good measurements that an innovation gate rejects. Smaller: wider gates.");
  read_motion(wm.table("motion"), &p.motion);
  read_drive(wm.table("drive"), &p.drive);
  wm.table("mount").get_deg("sigma_deg", &p.mount.sigma_rad, {1e-4, 10},
                            "Initial standard deviation of the LADAR mounting angle about each "
                            "axis; WM estimates the misalignment.");
  read_rolling(wm.table("rolling"), &p.rolling);
  read_prior(wm.table("prior"), &p.prior);
  read_stillness(wm.table("stillness"), &p.stillness);
  read_align(wm.table("align"), &p.align);
  read_history(wm.table("history"), &p.history);
  read_local(wm.table("local"), &p.local);
  read_modes(wm.table("modes"), &p.modes);
  read_fde(wm.table("fde"), &p.fault_detection);
  read_integrity(wm.table("integrity"), &p.integrity);
  read_terrain(wm.table("terrain"), &c);
  Pose T_vehicle_ladar;
  read_ladar_mount(root.table("ladar"), &T_vehicle_ladar);
  c.terrain.p_vehicle_ladar = T_vehicle_ladar.p;
  read_path_uncertainty(wm.table("path_uncertainty"), &c.path_uncertainty);

  if (Outcome read_all = file.finish(tables_but({"world", "gps", "ins", "odometry", "wm"}));
      !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::wm
