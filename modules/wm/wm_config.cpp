#include "modules/wm/wm_config.h"

#include <string>

#include "rcs/node/params/vehicle_tables.h"

namespace rcs::wm {
namespace {

// Data sheets' units.
constexpr double kDegPerSqrtHour = kPi / 180.0 / 60.0;
constexpr double kDegPerHour = kPi / 180.0 / 3600.0;
constexpr double kPerSqrtHour = 1.0 / 60.0;
constexpr double kMilliG = 9.80665e-3;

void get_scaled(ParamTable* table, std::string_view key, double unit, double* value, Range range) {
  double in_unit = *value / unit;
  table->get(key, &in_unit, range);
  *value = in_unit * unit;
}

void read_ins(ParamTable table, ProcessNoise* p) {
  std::string grade = "tactical";
  table.get("grade", &grade, {"tactical", "industrial", "consumer"});
  *p = ins_grade(grade);
  get_scaled(&table, "angle_random_walk_deg_per_sqrt_h", kDegPerSqrtHour, &p->angle_random_walk,
             {1e-5, 100});
  get_scaled(&table, "velocity_random_walk_mps_per_sqrt_h", kPerSqrtHour, &p->velocity_random_walk,
             {1e-5, 60});
  get_scaled(&table, "gyro_instability_deg_per_h", kDegPerHour, &p->gyro_instability, {1e-4, 1e4});
  get_scaled(&table, "accel_instability_mg", kMilliG, &p->accel_instability, {1e-4, 100});
  get_scaled(&table, "gyro_turn_on_deg_per_h", kDegPerHour, &p->gyro_turn_on, {1e-4, 2e4});
  get_scaled(&table, "accel_turn_on_mg", kMilliG, &p->accel_turn_on, {1e-4, 100});
  table.get("bias_time_s", &p->bias_time_s, {1, 1e5});
  table.get("scale_and_misalignment", &p->scale_and_misalignment, {0, 0.1});
  table.get_deg("mount_sigma_deg", &p->mount_sigma_rad, {0, 10});
  table.get("motion_time_s", &p->motion_time_s, {0.1, 60});
}

void read_gps(ParamTable table, GpsParams* p, DriveNoise* drive) {
  table.get("lever_m", &p->lever_m, {-20, 20});
  table.get("correlated", &p->correlated, {0, 0.999});
  table.get("sigma_floor_m", &p->sigma_floor_m, {1e-3, 10});
  table.get("sigma_time_s", &p->sigma_time_s, {0, 0.5});
  table.get("tau_s", &drive->gps_tau_s, {0.1, 1e5});
}

void read_odometry(ParamTable table, OdometryParams* p, DriveNoise* drive) {
  table.get("sigma_floor_mps", &p->sigma_floor_mps, {1e-3, 10});
  table.get("slip", &p->slip, {0, 1});
  table.get("lateral_mps", &p->lateral_mps, {1e-3, 10});
  table.get("vertical_mps", &p->vertical_mps, {1e-3, 10});
  table.get("heave_hz", &p->heave_hz, {0.1, 100});
  table.get("side_slip", &p->side_slip, {0, 1});
  table.get("scale_sigma", &p->scale_sigma, {1e-5, 0.5});
  table.get("climb_slip", &p->climb_slip, {0, 1});
  table.get("correlation_s", &drive->slip_correlation_s, {0.01, 1e5});
  table.get("constrained", &p->constrained);
  table.get("zero_velocity", &p->zero_velocity);
}

void read_motion(ParamTable table, MotionNoise* p) {
  table.get("acceleration", &p->acceleration, {1e-3, 100});
  table.get("angular_acceleration", &p->angular_acceleration, {1e-3, 100});
  table.get("yaw_acceleration", &p->yaw_acceleration, {1e-3, 100});
  table.get("tilt_time_s", &p->tilt_time_s, {0.01, 100});
  table.get("yaw_time_s", &p->yaw_time_s, {0.01, 100});
  table.get("rate_sigma", &p->rate_sigma, {1e-4, 10});
}

void read_drive(ParamTable table, DriveNoise* p) {
  table.get("rolling_position", &p->rolling_position, {0, 1});
  table.get("rolling_angle", &p->rolling_angle, {0, 0.1});
  table.get("mount_angle", &p->mount_angle, {0, 0.01});
  table.get("map_sigma_m", &p->map_sigma_m, {1e-3, 100});
  table.get("map_length_m", &p->map_length_m, {1, 1e5});
  table.get("wheel_scale", &p->wheel_scale, {0, 0.1});
}

void read_match(ParamTable* table, RegistrationParams* p) {
  table->get("inflation", &p->inflation, {1, 1000});
  table->get("sigma_floor_m", &p->sigma_floor_m, {0, 1});
  table->get("sigma_floor_rad", &p->sigma_floor_rad, {0, 0.1});
  table->get("sigma_time_s", &p->sigma_time_s, {0, 0.5});
  table->get("arm_m", &p->arm_m, {0.1, 100});
  table->get("observed_sigma_m", &p->observed_sigma_m, {1e-3, 100});
}

void read_rolling(ParamTable table, RollingParams* p) {
  read_match(&table, &p->match);
  table.get("refused_until_reset", &p->refused_until_reset, {2, 1000});
  table.get("inherited", &p->inherited, {0, 1});
}

void read_prior(ParamTable table, PriorMapParams* p) {
  read_match(&table, &p->match);
  table.get("mount_sigma_m", &p->mount_sigma_m, {0, 1});
  table.get("heading_sigma_rad", &p->heading_sigma_rad, {1e-4, 3.2});
  table.get("correlation_m", &p->correlation_m, {0.01, 1e4});
  table.get("bias_margin", &p->bias_margin, {1, 100});
  table.get("trust_m", &p->trust_m, {1, 1e4});
}

void read_stillness(ParamTable table, StillnessParams* p) {
  table.get("window_s", &p->window_s, {0.05, 10});
  table.get("rate_radps", &p->rate_radps, {1e-5, 1});
  table.get("accel_mps2", &p->accel_mps2, {1e-4, 10});
  table.get("speed_mps", &p->speed_mps, {1e-3, 10});
  table.get("sigma_mps", &p->sigma_mps, {1e-4, 1});
  table.get_ms("period_ms", &p->period, {10, 10000});
}

void read_align(ParamTable table, AlignParams* p) {
  table.get_ms("level_time_ms", &p->level_time, {100, 60000});
  table.get_ms("patience_ms", &p->patience, {100, 600000});
  table.get("level_sigma_mps2", &p->level_sigma_mps2, {1e-4, 5});
  table.get("moving_level_sigma_mps2", &p->moving_level_sigma_mps2, {1e-3, 5});
  table.get("tilt_sigma_rad", &p->tilt_sigma_rad, {1e-4, 0.8});
  table.get("speed_sigma_mps", &p->speed_sigma_mps, {1e-3, 100});
  table.get("baseline_m", &p->baseline_m, {0.5, 1000});
  table.get("heading_sigma_rad", &p->heading_sigma_rad, {1e-3, 0.5});
  table.get("course_speed_mps", &p->course_speed_mps, {0.5, 100});
}

void read_history(ParamTable table, HistoryParams* p) {
  table.get("capacity", &p->capacity, {64, 100000});
  table.get_ms("lag_ms", &p->lag, {10, 10000});
  table.get_ms("jump_ms", &p->jump, {100, 60000});
  table.get_ms("bridge_ms", &p->bridge, {1, 1000});
  table.get_ms("ins_timeout_ms", &p->ins_timeout, {10, 10000});
  table.get("clock_step_count", &p->clock_step_count, {2, 10000});
  if (p->jump < p->lag) table.fail("jump_ms", "must not be less than lag_ms");
}

void read_local(ParamTable table, LocalFrameParams* p) {
  table.get("slew_mps", &p->slew_mps, {1e-3, 10});
  table.get("slew_radps", &p->slew_radps, {1e-4, 10});
}

void read_modes(ParamTable table, ModeParams* p) {
  table.get_ms("gps_timeout_ms", &p->gps_timeout, {100, 60000});
  table.get_ms("rolling_timeout_ms", &p->rolling_timeout, {100, 60000});
  table.get_ms("input_timeout_ms", &p->input_timeout, {0, 60000});
  table.get("reset_m", &p->reset_m, {0.001, 100});
  table.get("reset_rad", &p->reset_rad, {1e-4, 3});
}

void read_terrain(ParamTable table, WmConfig* c) {
  TerrainParams& p = c->terrain;
  table.get("cell_m", &p.cell_m, {0.1, 2});
  table.get("size", &p.size, {64, 1024});
  table.get("patch", &p.patch, {32, 512});
  table.get("ahead_m", &p.ahead_m, {0, 100});
  table.get("overhang_m", &p.overhang_m, {0.5, 10});
  table.get("solid_m", &p.solid_m, {0.05, 2});
  table.get("obstacle_m", &p.obstacle_m, {0.05, 2});
  table.get("evidence", &p.evidence, {0.5, 10});
  table.get("near_m", &p.near_m, {0, 20});
  table.get("near_start_m", &p.near_start_m, {0, 20});
  table.get("max_range_m", &p.max_range_m, {5, 300});
  table.get_ms("period_ms", &c->map_period, {50, 10000});
  if ((p.size & (p.size - 1)) != 0) table.fail("size", "must be a power of two");
  if (2 * p.patch > p.size) table.fail("patch", "must not be more than half of size");
}

void read_path_uncertainty(ParamTable table, PathUncertaintyParams* p) {
  table.get("radius_m", &p->radius_m, {5, 200});
  table.get("drift", &p->drift, {1e-6, 1});
}

void read_trust(ParamTable table, TrustParams* p) {
  table.get_ms("silence_ms", &p->silence, {1000, 600000});
  table.get("refused", &p->refused, {2, 1000});
  table.get("agreeing", &p->agreeing, {2, 6});
  table.get_ms("agreeing_for_ms", &p->agreeing_for, {0, 60000});
  table.get_ms("persistent_ms", &p->persistent, {10000, 600000});
  table.get("persistent_m", &p->persistent_m, {10, 10000});
  table.get_ms("probation_ms", &p->probation, {1000, 60000});
  table.get_ms("branch_ms", &p->branch, {2000, 60000});
  table.get("doubted", &p->doubted, {1, 100});
  table.get_ms("ladar_doubted_ms", &p->ladar_doubted, {100, 60000});
  table.get("matches", &p->matches, {2, 1000});
  table.get("false_alarm", &p->false_alarm, {1e-12, 1e-3});
  table.get("floor_m", &p->floor_m, {0.01, 10});
  table.get("floor_share", &p->floor_share, {0, 0.1});
  table.get("floor_mps", &p->floor_mps, {0, 1});
  table.get("attitude_sigma_rad", &p->attitude_sigma_rad, {1e-3, 1});
  table.get("cusum", &p->cusum, {3, 1000});
}

void read_integrity(ParamTable table, IntegrityParams* p) {
  table.get("limit_horizontal_m", &p->limit_horizontal_m, {0.1, 1000});
  table.get("limit_vertical_m", &p->limit_vertical_m, {0.1, 1000});
}

std::optional<Geodetic> read_datum(ParamTable world) {
  const bool given =
      world.has("datum_lat_deg") || world.has("datum_lon_deg") || world.has("datum_height_m");
  Geodetic datum;
  world.get_deg("datum_lat_deg", &datum.lat_rad, {-90, 90});
  world.get_deg("datum_lon_deg", &datum.lon_rad, {-180, 360});
  world.get("datum_height_m", &datum.height.m, {-1000, 20000});
  if (!given) return std::nullopt;
  for (const std::string_view key : {"datum_lat_deg", "datum_lon_deg", "datum_height_m"}) {
    if (!world.has(key)) world.fail(key, "is missing: a datum is given whole or not at all");
  }
  return datum;
}

}  // namespace

ProcessNoise ins_grade(std::string_view grade) {
  // As data sheets have them: deg/sqrt(h), m/s/sqrt(h), deg/h, mg, s, deg/h, mg.
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
  read_gps(root.table("gps"), &p.gps, &p.drive);
  read_ins(root.table("ins"), &p.ins);
  read_odometry(root.table("odometry"), &p.odometry, &p.drive);

  ParamTable wm = root.table("wm");
  wm.get_ms("budget_ms", &c.info.budget, {1, 1000});
  wm.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000});
  wm.get_ms("period_ms", &c.period, {5, 1000});
  wm.get("false_alarm", &p.false_alarm, {1e-9, 0.1});
  read_motion(wm.table("motion"), &p.motion);
  read_drive(wm.table("drive"), &p.drive);
  wm.table("mount").get_deg("sigma_deg", &p.mount.sigma_rad, {1e-4, 10});
  read_rolling(wm.table("rolling"), &p.rolling);
  read_prior(wm.table("prior"), &p.prior);
  read_stillness(wm.table("stillness"), &p.stillness);
  read_align(wm.table("align"), &p.align);
  read_history(wm.table("history"), &p.history);
  read_local(wm.table("local"), &p.local);
  read_modes(wm.table("modes"), &p.modes);
  read_trust(wm.table("trust"), &p.trust);
  read_integrity(wm.table("integrity"), &p.integrity);
  read_terrain(wm.table("terrain"), &c);
  read_path_uncertainty(wm.table("path_uncertainty"), &c.path_uncertainty);

  if (Outcome read_all = file.finish(tables_but({"world", "gps", "ins", "odometry", "wm"}));
      !read_all) {
    return read_all.error();
  }
  return c;
}

}  // namespace rcs::wm
