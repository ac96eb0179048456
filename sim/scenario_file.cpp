#include "sim/scenario_file.h"

#include <fstream>
#include <sstream>
#include <utility>

#include "rcs/base/regular_file.h"
#include "rcs/node/params/params.h"
#include "sim/actors_file.h"
#include "sim/world_file.h"

namespace rcs::sim {
namespace {

void read_hazards(ParamTable table, HazardParams* hazards) {
  table.get(
      "kinds", &hazards->kinds,
      "Hazards that are drawn by seed, one across each leg of the course: drop, ledge, ditch, "
      "wall, bank, low_drop, low_ledge, small_ditch, slope (around the limits of the vehicle), "
      "gate, dead_end, pen (around the end of the leg). Empty: none.");
  if (const std::string unknown = unknown_hazard(hazards->kinds); !unknown.empty()) {
    table.fail("kinds", "\"" + unknown +
                            "\" is not one of drop, ledge, ditch, wall, bank, low_drop, low_ledge, "
                            "small_ditch, slope, gate, dead_end, pen");
  }
  table.get("depth_max_m", &hazards->depth_max_m, {15, 200}, "Depth of the deepest dead end.");
  table.get("length_min_m", &hazards->length_min_m, {2, 200}, "Shortest hazard.");
  table.get("length_max_m", &hazards->length_max_m, {hazards->length_min_m, 200},
            "Longest hazard, not less than length_min_m.");
  table.get_deg("turn_deg", &hazards->turn_rad, {0, 80},
                "Largest angle from straight across the leg.");
}

void read_outages(ParamTable* table, std::vector<Outage>* outages) {
  if (table->has("outage")) outages->clear();
  for (ParamTable outage : table->tables("outage")) {
    Outage o;
    outage.get("begin_s", &o.begin_s, {0, 1e5},
               "Beginning of an outage of the sensor, in simulation time.");
    outage.get("length_s", &o.length_s, {0, 1e5},
               "Duration of an outage of the sensor; no message is published within it.");
    outages->push_back(o);
  }
}

RandomCourseParams read_random_course(ParamTable table) {
  RandomCourseParams random;
  table.get("count", &random.count, {1, 100}, "Number of random waypoints after the start.");
  table.get("leg_min_m", &random.leg_min_m, {5, 500}, "Shortest leg between random waypoints.");
  table.get("leg_max_m", &random.leg_max_m, {random.leg_min_m, 500},
            "Longest leg between random waypoints, not less than leg_min_m.");
  table.get_deg("turn_deg", &random.turn_rad, {0, 180},
                "Largest change of heading at a random waypoint, to either side.");
  return random;
}

/// @param random  set if the waypoints are to be drawn
void read_course(ParamTable table, CourseParams* course,
                 std::optional<RandomCourseParams>* random) {
  table.get("rest_s", &course->rest_s, {0, 600},
            "Time at rest before the drive, for the alignment.");
  double speed_kmph = course->speed_mps * 3.6;
  table.get("speed_kmph", &speed_kmph, {1, 108},
            "Top speed of the scripted drive; with [drive] mode commanded, of the operator's "
            "waypoints [km/h].");
  course->speed_mps = speed_kmph / 3.6;
  table.get("acceleration_mps2", &course->acceleration_mps2, {0.1, 5},
            "Acceleration and deceleration of the scripted drive.");
  table.get("lateral_mps2", &course->lateral_mps2, {0.1, 8},
            "Lateral acceleration that limits the speed of the scripted drive in turns.");
  if (table.has("random")) {
    if (table.has("waypoint")) table.fail("random", "cannot be combined with waypoints");
    *random = read_random_course(table.table("random"));
    return;
  }
  if (table.has("waypoint")) {
    random->reset();
    course->waypoints_world.clear();
  }
  read_line(&table, "waypoint", &course->waypoints_world);
  if (!*random && course->waypoints_world.size() < 2) {
    table.fail("waypoint", "at least two are needed");
  }
}

void read_vehicle(ParamTable table, VehicleParams* vehicle) {
  table.get("wheelbase_m", &vehicle->wheelbase_m, {0.5, 10}, "Distance between the axles.");
  table.get("track_m", &vehicle->track_m, {0.5, 5}, "Distance between the left and right wheels.");
  table.get("imu_height_m", &vehicle->imu_height_m, {0.1, 3},
            "Height of the vehicle frame's origin above level ground at rest.");
  table.get("contact_m", &vehicle->contact_m, {0.05, 2},
            "Length of ground that a wheel averages over. Larger: smoother ride.");
  table.get("heave_hz", &vehicle->heave_hz, {0.5, 10},
            "Natural frequency of the body on its suspension in heave.");
  table.get("tilt_hz", &vehicle->tilt_hz, {0.5, 10},
            "Natural frequency of the body on its suspension in pitch and roll.");
  table.get("damping", &vehicle->damping, {0.05, 2},
            "Damping ratio of the suspension [1]; 1 is critical.");
}

void read_drive(ParamTable table, Scenario* s) {
  std::string mode = s->commanded ? "commanded" : "scripted";
  table.get("mode", &mode, {"scripted", "commanded"},
            "Scripted: the vehicle follows the course. Commanded: drive commands of BG move it.");
  s->commanded = mode == "commanded";
  DriveParams& drive = s->drive;
  table.get("speed_max_mps", &drive.speed_max_mps, {0.1, 30},
            "Largest speed forward; a command with a larger one is rejected as implausible.");
  table.get("reverse_max_mps", &drive.reverse_max_mps, {0, 10},
            "Largest speed backwards; a command with a larger one is rejected as implausible.");
  table.get("acceleration_mps2", &drive.acceleration_mps2, {0.1, 10},
            "Acceleration of the commanded vehicle when it speeds up.");
  table.get("braking_mps2", &drive.braking_mps2, {0.1, 10},
            "Deceleration of the commanded vehicle without the brake command, and when no valid "
            "command is in force.");
  table.get("hard_braking_mps2", &drive.hard_braking_mps2, {0.1, 10},
            "Deceleration of the commanded vehicle with the brake command.");
  table.get(
      "curvature_max_1pm", &drive.curvature_max_1pm, {0.01, 1},
      "Largest curvature of the steering; a command with a larger one is rejected as implausible.");
  table.get("curvature_rate", &drive.curvature_rate, {0.01, 10},
            "Largest rate at which the steering changes the curvature [1/(m s)].");
  double delay_ms = drive.delay_s * 1e3;
  table.get("delay_ms", &delay_ms, {50, 1000},
            "Delay of the actuators, from the arrival of a command to its effect.");
  drive.delay_s = delay_ms * 1e-3;
  table.get("rear_steer", &drive.rear_steer, {0, 1},
            "Steering of the rear axle against the front axle as a share [1]. 1: no side slip of "
            "the vehicle frame; 0: front steering alone.");
}

void read_ladar(ParamTable table, Scenario* s) {
  std::string kind = s->ladar == LadarKind::kImager     ? "imager"
                     : s->ladar == LadarKind::kSpinning ? "spinning"
                                                        : "none";
  table.get("kind", &kind, {"imager", "spinning", "none"},
            "LADAR of the vehicle: range imager on a tilting head, spinning LADAR, or none.");
  s->ladar = kind == "imager"     ? LadarKind::kImager
             : kind == "spinning" ? LadarKind::kSpinning
                                  : LadarKind::kNone;
  table.get("max_range_m", &s->beam.max_range_m, {1, 300}, "Largest range that returns.");
  table.get("sigma_m", &s->beam.sigma_m, {0, 1},
            "Range noise at normal incidence, one standard deviation.");
  table.get_deg("beam_half_angle_deg", &s->beam.half_angle_rad, {0, 1},
                "Half angle of the beam's divergence. Larger: more mixed pixels and noise on "
                "slanted surfaces; 0: none.");
  table.get(
      "incidence_share", &s->beam.incidence_share, {0, 1},
      "Share of the range spread over the footprint on a slanted surface that is range noise [1].");
  table.get("missing_share", &s->beam.missing_share, {0, 0.99},
            "Share of the returns that are missing in all, those of empty facets included [1].");
  table.get("empty_facet_share", &s->beam.empty_facet_share, {0, s->beam.missing_share},
            "Share of the facets without any return [1], part of missing_share and at most that.");
  table.get_pose(
      "mount", &s->mount.T_vehicle_mount, {-10, 10},
      "Nominal pose of the LADAR head at rest in the vehicle frame (x ahead, y left, z up).");
  table.get(
      "mount_error_m", &s->mount.error_m, {0, 1},
      "Size of the uncalibrated position error of the mount; its direction depends on the seed.");
  table.get_deg(
      "mount_error_deg", &s->mount.error_rad, {0, 10},
      "Size of the uncalibrated attitude error of the mount; its axis depends on the seed.");
  double offset_ms = s->ladar_clock_offset_s * 1e3;
  table.get("clock_offset_ms", &offset_ms, {-100, 100},
            "Offset of the LADAR's stamps from true time. Positive: stamps are late.");
  s->ladar_clock_offset_s = offset_ms * 1e-3;
  read_outages(&table, &s->ladar_outages);

  ParamTable imager = table.table("imager");
  imager.get("rows", &s->imager.rows, {1, 256}, "Rows of a range image, a multiple of facets.");
  imager.get("cols", &s->imager.cols, {1, 2048}, "Columns of a range image.");
  imager.get("facets", &s->imager.facets, {1, 256},
             "Facets of a range image, each published as a message.");
  imager.get_deg("fov_v_deg", &s->imager.fov_v_rad, {1, 120},
                 "Vertical field of view of the range imager.");
  imager.get_deg("fov_h_deg", &s->imager.fov_h_rad, {1, 360},
                 "Horizontal field of view of the range imager.");
  imager.get("period_s", &s->imager.period_s, {0.02, 10}, "Period of a scan of the range imager.");
  imager.get_deg("tilt_deg", &s->imager.tilt_rad, {-60, 60},
                 "Tilt of the head, positive up; with a sweep, its middle.");
  imager.get_deg("sweep_deg", &s->imager.sweep_rad, {0, 60},
                 "Amplitude of the sinusoidal tilt sweep of the head; 0: the head is fixed.");
  imager.get("sweep_hz", &s->imager.sweep_hz, {0, 5}, "Frequency of the tilt sweep of the head.");
  if (s->imager.rows % s->imager.facets != 0) imager.fail("facets", "rows must be a multiple");

  ParamTable spinning = table.table("spinning");
  spinning.get("beams", &s->spinning.beams, {2, 256},
               "Number of beams of the spinning LADAR; row 0 is the lowest.");
  spinning.get("cols", &s->spinning.cols, {48, 4096},
               "Columns of a revolution, a multiple of sectors; clockwise from straight behind.");
  spinning.get("sectors", &s->spinning.sectors, {1, 256},
               "Sectors of a revolution, each published as a message.");
  spinning.get_deg("lowest_deg", &s->spinning.lowest_rad, {-60, 60},
                   "Elevation of the lowest beam.");
  spinning.get_deg("highest_deg", &s->spinning.highest_rad, {-60, 60},
                   "Elevation of the highest beam.");
  spinning.get("period_s", &s->spinning.period_s, {0.02, 10},
               "Period of a revolution of the spinning LADAR.");
  if (s->spinning.cols % s->spinning.sectors != 0) {
    spinning.fail("sectors", "cols must be a multiple");
  }
}

void read_gps(ParamTable table, GpsParams* gps) {
  table.get("interval_s", &gps->interval_s, {0.05, 10}, "Interval of the GPS fixes.");
  table.get("latency_s", &gps->latency_s, {0, 1},
            "Latency of a fix, from its time of validity to its arrival.");
  table.get("antenna_m", &gps->p_vehicle_antenna, {-10, 10},
            "Position of the GPS antenna in the vehicle frame (x ahead, y left, z up).");
  table.get(
      "sigma_m", &gps->sigma_m, {0, 100},
      "Standard deviation of the time-correlated (Gauss-Markov) position error on each axis.");
  table.get("correlation_s", &gps->correlation_s, {0.1, 1e4},
            "Correlation time of the time-correlated position error.");
  table.get("white_m", &gps->white_m, {0, 100},
            "Standard deviation of the white position noise on each axis.");
  table.get("sigma_v_mps", &gps->sigma_v_mps, {0, 10},
            "Standard deviation of the white velocity noise on each axis.");
  table.get("undulation_m", &gps->undulation_m, {-110, 90},
            "Geoid undulation reported in the fixes.");
  read_outages(&table, &gps->outages);
  table.get("lost_after_m", &gps->lost_after_m, {0, 1e5},
            "Distance driven after which GPS is lost for the rest of the drive; 0: it is not.");
}

void read_odometry(ParamTable table, OdometryParams* odometry) {
  table.get("interval_s", &odometry->interval_s, {0.01, 1}, "Interval of the odometry messages.");
  table.get("scale_error", &odometry->scale_error, {0, 0.2},
            "Size of the scale error by the wheel radius [1]; its sign depends on the seed.");
  table.get("slip_per_grade", &odometry->slip_per_grade, {0, 1},
            "Wheel slip per sine of the climb angle [1].");
  table.get("sigma_speed_mps", &odometry->sigma_speed_mps, {0, 5},
            "Standard deviation of the white noise of the wheel speed.");
  double yaw_rate_degps = degrees(odometry->sigma_yaw_rate_radps);
  table.get("sigma_yaw_rate_degps", &yaw_rate_degps, {0, 60},
            "Standard deviation of the white noise of the yaw rate [deg/s].");
  odometry->sigma_yaw_rate_radps = radians(yaw_rate_degps);
}

void read_prior_map(ParamTable table, PriorMapParams* map) {
  table.get("cell_m", &map->cell_m, {0.2, 100}, "Cell of the simulated a priori map.");
  table.get("sigma_m", &map->sigma_m, {0.001, 50},
            "Standard deviation of the white height error of a map cell.");
  table.get(
      "bias_sigma_m", &map->bias_sigma_m, {0, 50},
      "Standard deviation of the systematic (spatially correlated) height error of the survey.");
  table.get("bias_correlation_m", &map->bias_correlation_m, {1, 1e5},
            "Correlation length of the systematic height error of the survey.");
  table.get("margin_m", &map->margin_m, {20, 2000},
            "Margin of the a priori map around the course.");
}

// The file uses the units of data sheets.
InertialGrade read_grade(ParamTable table) {
  constexpr double kHour = 3600.0;
  constexpr double kMilliG = 9.80665e-3;
  double bias_degph = 0, instability_degph = 0, walk_degprh = 0;
  double bias_mg = 0, instability_mg = 0, walk_mpsprh = 0;
  InertialGrade grade;
  table.get("gyro_bias_degph", &bias_degph, {0, 1e5},
            "Turn-on bias of the gyros, one standard deviation [deg/h].");
  table.get("gyro_instability_degph", &instability_degph, {0, 1e5},
            "In-run bias instability of the gyros, one standard deviation of a Gauss-Markov "
            "process [deg/h].");
  table.get("gyro_walk_degprh", &walk_degprh, {0, 100},
            "Angle random walk of the gyros [deg/sqrt(h)].");
  table.get("accel_bias_mg", &bias_mg, {0, 1000},
            "Turn-on bias of the accelerometers, one standard deviation.");
  table.get("accel_instability_mg", &instability_mg, {0, 1000},
            "In-run bias instability of the accelerometers, one standard deviation of a "
            "Gauss-Markov process.");
  table.get("accel_walk_mpsprh", &walk_mpsprh, {0, 100},
            "Velocity random walk of the accelerometers [m/s/sqrt(h)].");
  table.get("correlation_s", &grade.correlation_s, {1, 1e5},
            "Correlation time of the bias instabilities of gyros and accelerometers.");
  grade.gyro_bias_radps = radians(bias_degph) / kHour;
  grade.gyro_instability_radps = radians(instability_degph) / kHour;
  grade.gyro_walk_radprs = radians(walk_degprh) / 60.0;  // per root of an hour
  grade.accel_bias_mps2 = bias_mg * kMilliG;
  grade.accel_instability_mps2 = instability_mg * kMilliG;
  grade.accel_walk_mpsrs = walk_mpsprh / 60.0;
  return grade;
}

Outcome read_grades(const std::string& path, const std::string& name, InertialGrade* grade) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  std::string known;
  bool found = false;
  for (ParamTable table : file->root().tables("grade")) {
    std::string grade_name;
    table.get("name", &grade_name, "Name of the grade, by which a scenario selects it.");
    const InertialGrade read = read_grade(table);
    known += (known.empty() ? "" : ", ") + grade_name;
    if (grade_name != name) continue;
    *grade = read;
    found = true;
  }
  if (Outcome finished = file->finish({}); !finished) return finished;
  if (!found) return Error{path + ": no INS grade " + name + "; there are: " + known};
  return Done{};
}

Result<Dem> read_dem(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) return Error{path + ": cannot be read"};
  return parse_esri_ascii(text.str(), path);
}

/// Values of the files read so far, the base first.
struct Reading {
  Scenario scenario;
  std::int64_t seed = 1;
  bool world_seed_follows = false;
  std::optional<RandomCourseParams> random_course;
  HazardParams hazards;
  ActorParams actors;
  std::string dem;  // paths
  std::string grades;
};

void read_ins(const ParamFile& file, Reading* out) {
  ParamTable ins = file.root().table("ins");
  InertialParams& params = out->scenario.ins;
  std::string grades = "ins_grades.toml";
  const bool named = ins.has("grades");
  ins.get("grades", &grades, "File of the INS grades, relative to this file.");
  if (named || out->grades.empty()) out->grades = file.resolve(grades);
  ins.get("grade", &params.grade_name,
          "INS grade of the scenario, one of the names in the file of the grades.");
  ins.get("interval_s", &params.interval_s, {0.001, 0.1}, "Interval of the INS samples.");
  double scale_ppm = params.scale_error * 1e6;
  ins.get("scale_error_ppm", &scale_ppm, {0, 1e5},
          "Size of the uncalibrated scale-factor error of each axis [1e-6]; its sign depends on "
          "the seed.");
  params.scale_error = scale_ppm * 1e-6;
  ins.get_deg(
      "misalignment_deg", &params.misalignment_rad, {0, 5},
      "Size of the uncalibrated rotation of the sensor triad; its axis depends on the seed.");
}

/// A file that is based on another contains only the differences; a list replaces that of the base.
Outcome read_file(const std::string& path, int depth, Reading* out) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  ParamTable root = file->root();
  std::string base;
  root.get("based_on", &base,
           "Scenario that this one is based on, relative to this file; keys given here replace its "
           "keys. Empty: none.");
  if (!base.empty()) {
    if (depth == 0) return Error{path + ": based_on is circular or nested too deeply"};
    if (Outcome read = read_file(file->resolve(base), depth - 1, out); !read) return read;
  }
  Scenario& s = out->scenario;
  root.get(
      "seed", &out->seed, {0, 1e15},
      "Seed of all noise and of the mounting errors, and of the world where seed_follows is true.");
  root.get(
      "duration_s", &s.duration_s, {0, 1e5},
      "Duration of the drive; 0: to the end of the scripted course. A commanded drive needs one.");
  std::string dem;
  read_world(root.table("world"), &s.world, &out->world_seed_follows, &dem, &s.datum);
  if (!dem.empty()) out->dem = file->resolve(dem);
  read_course(root.table("course"), &s.course, &out->random_course);
  read_hazards(root.table("hazards"), &out->hazards);
  read_actors(&root, &s.actors);
  read_actor_params(root.table("actors"), &out->actors);
  read_vehicle(root.table("vehicle"), &s.vehicle);
  read_drive(root.table("drive"), &s);
  read_ladar(root.table("ladar"), &s);
  read_ins(*file, out);
  read_gps(root.table("gps"), &s.gps);
  read_odometry(root.table("odometry"), &s.odometry);
  read_prior_map(root.table("prior_map"), &s.prior_map);
  return file->finish({});
}

}  // namespace

Result<Scenario> load_scenario(const std::string& path, const ScenarioOverrides& overrides) {
  constexpr int kBases = 4;
  Reading reading;
  if (const Outcome read = read_file(path, kBases, &reading); !read) return read.error();
  Scenario& s = reading.scenario;
  const std::int64_t seed = overrides.seed.value_or(reading.seed);
  if (seed < 0) return Error{path + ": the seed must not be negative"};
  s.seed = static_cast<std::uint64_t>(seed);
  if (reading.world_seed_follows) s.world.seed = s.seed;
  if (reading.random_course) {
    s.course.waypoints_world = random_waypoints(*reading.random_course, s.seed);
  }
  for (const Feature& f : draw_hazards(reading.hazards, s.course.waypoints_world, s.seed)) {
    s.world.features.push_back(f);
  }
  for (const ActorScript& actor : draw_actors(reading.actors, s.course.waypoints_world,
                                              s.course.speed_mps, s.course.rest_s, s.seed)) {
    s.actors.push_back(actor);
  }
  if (overrides.duration_s) s.duration_s = *overrides.duration_s;
  if (s.commanded && s.duration_s <= 0.0) {
    return Error{path + ": duration_s is missing: a commanded drive needs one"};
  }
  if (overrides.gps_outage) s.gps.outages = {*overrides.gps_outage};
  if (overrides.ladar_outage) s.ladar_outages = {*overrides.ladar_outage};
  if (overrides.gps_lost_after_m) s.gps.lost_after_m = *overrides.gps_lost_after_m;
  if (!overrides.ins_grade.empty()) s.ins.grade_name = overrides.ins_grade;
  const Outcome graded = read_grades(reading.grades, s.ins.grade_name, &s.ins.grade);
  if (!graded) return graded.error();
  if (!reading.dem.empty()) {
    Result<Dem> read = read_dem(reading.dem);
    if (!read) return read.error();
    s.dem = std::move(*read);
  }
  return std::move(s);
}

}  // namespace rcs::sim
