#include "modules/gateway/sample_conversion.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace rcs::gateway {
namespace {

// Converted by value.
static_assert(rcs_NAV_ALIGN == nav_state_t::MODE_ALIGN &&
              rcs_NAV_GPS_INS == nav_state_t::MODE_GPS_INS &&
              rcs_NAV_GPS_INS_LADAR == nav_state_t::MODE_GPS_INS_LADAR &&
              rcs_NAV_INS_LADAR == nav_state_t::MODE_INS_LADAR &&
              rcs_NAV_INS_DR == nav_state_t::MODE_INS_DR &&
              rcs_NAV_GPS_LADAR == nav_state_t::MODE_GPS_LADAR &&
              rcs_NAV_LADAR == nav_state_t::MODE_LADAR && rcs_NAV_LOST == nav_state_t::MODE_LOST);

template <std::size_t N>
bool copy(const double (&in)[N], double (&out)[N]) {
  std::copy(std::begin(in), std::end(in), out);
  return std::all_of(std::begin(in), std::end(in), [](double x) { return std::isfinite(x); });
}

template <std::size_t N>
std::string_view view(const char (&text)[N]) {
  return {text, static_cast<std::size_t>(std::find(text, text + N, '\0') - text)};
}

std::string operator_of(std::string_view claimed, std::string_view writer_partition) {
  return std::string(claimed == writer_partition ? claimed : std::string_view());
}

}  // namespace

bool to_sample(const nav_state_t& m, Duration age, rcs_VehicleState* out) {
  if (m.mode < nav_state_t::MODE_ALIGN || m.mode > nav_state_t::MODE_LOST) return false;
  out->utime = m.utime;
  out->age_us = age.count();
  out->mode = static_cast<rcs_NavMode>(m.mode);
  out->world_valid = m.world_valid != 0;
  bool finite = copy(m.q_world_vehicle, out->q_world_vehicle);
  finite = copy(m.p_world_vehicle_m, out->p_world_vehicle_m) && finite;
  finite = copy(m.q_local_vehicle, out->q_local_vehicle) && finite;
  finite = copy(m.p_local_vehicle_m, out->p_local_vehicle_m) && finite;
  finite = copy(m.v_world_mps, out->v_world_mps) && finite;
  finite = copy(m.rate_vehicle_radps, out->rate_vehicle_radps) && finite;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      out->cov_world_pose[6 * i + j] = m.cov_world_pose[i][j];
      finite = finite && std::isfinite(m.cov_world_pose[i][j]);
    }
  }
  out->datum_lat_deg = m.datum_lat_deg;
  out->datum_lon_deg = m.datum_lon_deg;
  out->datum_height_m = m.datum_height_m;
  out->world_resets = m.world_resets;
  out->age_ins_us = m.age_ins_us;
  out->age_gps_us = m.age_gps_us;
  out->age_odometry_us = m.age_odometry_us;
  out->age_rolling_us = m.age_rolling_us;
  out->age_prior_map_us = m.age_prior_map_us;
  out->distance_since_gps_m = m.distance_since_gps_m;
  return finite && std::isfinite(m.datum_lat_deg) && std::isfinite(m.datum_lon_deg) &&
         std::isfinite(m.datum_height_m) && std::isfinite(m.distance_since_gps_m);
}

void to_sample(const NodeStatusTable& table, std::size_t node, Stamp now, rcs_NodeStatus* out) {
  const NodeFacts& f = table.facts(node);
  to_sample(table.name(node), out->node);
  out->alive = table.alive(node, now);
  out->age_us = table.age(node, now).count();
  to_sample(f.state, out->state);
  to_sample(f.reason, out->reason);
  out->degrade_level = static_cast<std::uint8_t>(std::max<std::int8_t>(f.degrade_level, 0));
  out->cycles = f.cycles;
  out->missed = f.missed;
  out->overruns = f.overruns;
}

WaypointCommand from_sample(const rcs_WaypointCommand& sample, std::string_view writer_partition) {
  WaypointCommand command;
  command.operator_id = operator_of(view(sample.operator_id), writer_partition);
  command.command_id = sample.command_id;
  command.kind = static_cast<int>(sample.kind);
  command.frame = static_cast<int>(sample.frame);
  command.valid_for = Duration(std::int64_t{1000} * sample.valid_for_ms);
  command.waypoints.resize(sample.waypoints._length);
  for (std::size_t i = 0; i < command.waypoints.size(); ++i) {
    const rcs_Waypoint& w = sample.waypoints._buffer[i];
    command.waypoints[i] = {{w.p_m[0], w.p_m[1], w.p_m[2]}, w.radius_m, w.speed_mps};
  }
  return command;
}

StopCommand from_sample(const rcs_EmergencyStop& sample, std::string_view writer_partition) {
  return {operator_of(view(sample.operator_id), writer_partition), sample.command_id,
          sample.engage};
}

Command to_command(const Action& action) {
  constexpr std::int8_t kKinds[] = {command_t::KIND_HALT, command_t::KIND_GOTO,
                                    command_t::KIND_EMERGENCY_STOP, command_t::KIND_RELEASE};
  constexpr std::int8_t kOrders[] = {command_t::KIND_HALT, command_t::KIND_GOTO,
                                     command_t::KIND_FOLLOW, command_t::KIND_RETURN};
  static_assert(kFrameWorld == command_t::FRAME_WORLD && kFrameLocal == command_t::FRAME_LOCAL);
  Command out;
  out.kind = kKinds[static_cast<std::size_t>(action.kind)];
  out.valid_for = action.valid_for;
  if (action.command == nullptr) return out;
  out.kind = kOrders[static_cast<std::size_t>(action.command->kind)];
  out.frame = static_cast<std::int8_t>(action.command->frame);
  // A restarted gateway continues with the commands that its operators repeat.
  out.task = action.command->command_id;
  for (const Waypoint& w : action.command->waypoints) {
    waypoint_t m{};
    for (int i = 0; i < 3; ++i) m.p_m[i] = w.p_m[i];
    m.radius_m = w.radius_m;
    m.speed_mps = w.speed_mps;
    out.waypoints.push_back(m);
  }
  return out;
}

}  // namespace rcs::gateway
