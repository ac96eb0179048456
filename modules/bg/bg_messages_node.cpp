#include "modules/bg/bg_messages_node.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcmtypes/convert.h"
#include "lcmtypes/local_levels.h"
#include "lcmtypes/plausible.h"
#include "rcs/node/waypoint_check.h"

namespace rcs::bg {
namespace {

constexpr double kFarthest_m = 1e6;
constexpr int kMaxCells = 1024 * 1024;
constexpr std::int16_t kUnknownHeight = -32768;

bool is_frame(std::int8_t frame) {
  return frame == command_t::FRAME_WORLD || frame == command_t::FRAME_LOCAL ||
         frame == command_t::FRAME_ROLLING;
}

/// Why the content of a GOTO cannot be executed; empty: it can.
std::string_view objection(const command_t& m) {
  if (!is_frame(m.frame)) {
    return "command rejected: the frame of the waypoints is unknown";
  }
  return waypoint_objection(m);
}

bool same(const waypoint_t& a, const waypoint_t& b) {
  return std::equal(std::begin(a.p_m), std::end(a.p_m), std::begin(b.p_m)) &&
         a.radius_m == b.radius_m && a.speed_mps == b.speed_mps;
}

Duration sum(std::int64_t age_us, Duration more) {
  constexpr std::int64_t kCentury_us = 3'000'000'000'000'000;
  if (age_us < 0 || age_us > kCentury_us || more == Duration::max()) return Duration::max();
  return Duration(age_us) + more;
}

/// The rises of the planes, from the heights of the neighbours.
void set_rises(vj::Terrain* terrain) {
  const int width = terrain->width;
  std::vector<vj::Ground>& ground = terrain->ground;
  for (int j = 0; j < terrain->height; ++j) {
    for (int i = 0; i < width; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(i);
      const auto rise = [&](std::size_t step, bool before, bool after) {
        const vj::Ground& a = ground[before ? k - step : k];
        const vj::Ground& b = ground[after ? k + step : k];
        const int cells = (before ? 1 : 0) + (after ? 1 : 0);
        if (!a.known || !b.known || cells == 0) return 0.0F;
        const float rise_m = b.height_m - a.height_m;
        return std::isfinite(rise_m) ? rise_m / static_cast<float>(cells * terrain->cell_m) : 0.0F;
      };
      ground[k].rise_x = rise(1, i > 0, i + 1 < width);
      ground[k].rise_y = rise(static_cast<std::size_t>(width), j > 0, j + 1 < terrain->height);
    }
  }
}

}  // namespace

CommandKind kind_of(const command_t& m) {
  switch (m.kind) {
    case command_t::KIND_HALT:
    case command_t::KIND_ABORT:
      return CommandKind::kHalt;
    case command_t::KIND_GOTO:
      return CommandKind::kGoto;
    case command_t::KIND_EMERGENCY_STOP:
      return CommandKind::kEmergencyStop;
    case command_t::KIND_RELEASE:
      return CommandKind::kRelease;
    default:
      return CommandKind::kUnknown;
  }
}

bool Route::is_task_of(const command_t& m) const {
  return m.task != 0 && m.task == task_ && m.issuer == issuer_ && m.frame == frame_ &&
         m.map_epoch == map_epoch_;
}

std::string_view Route::take(const command_t& m) {
  if (const std::string_view cannot = objection(m); !cannot.empty()) {
    clear();
    return cannot;
  }
  const auto done = static_cast<std::size_t>(m.waypoints_done);
  if (is_task_of(m)) {
    if (std::equal(m.waypoint.begin(), m.waypoint.end(), waypoints_.begin(), waypoints_.end(),
                   same)) {
      next_ = std::max(next_, done);
      return "";
    }
    const auto next =
        arrived() ? m.waypoint.end()
                  : std::find_if(m.waypoint.begin(), m.waypoint.end(), [this](const waypoint_t& w) {
                      return same(w, waypoints_[next_]);
                    });
    if (next != m.waypoint.end()) {
      next_ = std::max(static_cast<std::size_t>(next - m.waypoint.begin()), done);
      waypoints_ = m.waypoint;
      return "";
    }
  }
  waypoints_ = m.waypoint;
  next_ = done;
  frame_ = m.frame;
  map_epoch_ = m.map_epoch;
  issuer_ = m.issuer;
  task_ = m.task;
  ++number_;
  return "";
}

std::size_t Route::ahead(std::size_t from, double distance_m) const {
  while (from + 1 < waypoints_.size() && distance_m > 0.0) {
    const Vec3 here = from_message(waypoints_[from].p_m);
    distance_m -= (from_message(waypoints_[++from].p_m) - here).norm();
  }
  return from;
}

void Route::clear() {
  waypoints_.clear();
  next_ = 0;
  task_ = 0;
  ++number_;
}

bool read_nav(const nav_state_t& m, Stamp arrival, Nav* nav) {
  Nav n;
  // A variance that is not a number must not pass for a certain pose.
  const double variance_x = m.cov_world_pose[0][0];
  const double variance_y = m.cov_world_pose[1][1];
  const bool good = plausible_motion(m) && variance_x >= 0.0 && variance_y >= 0.0 &&
                    from_message(m.q_local_vehicle, m.p_local_vehicle_m, &n.T_local_vehicle) &&
                    from_message(m.q_world_vehicle, m.p_world_vehicle_m, &n.T_world_vehicle);
  if (!good) return false;
  n.stamp = from_utime(m.utime);
  n.arrival = arrival;
  n.local_utime = m.local_utime;
  n.world_valid = m.world_valid != 0;
  n.world_resets = m.world_resets;
  n.datum = {m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m};
  n.pose_valid = m.pose_valid != 0;
  n.aligned = m.mode != nav_state_t::MODE_ALIGN && m.mode != nav_state_t::MODE_LOST;
  n.speed_mps = (n.T_world_vehicle.q.conjugate() * from_message(m.v_world_mps)).x();
  n.sigma_world_m = std::sqrt(std::max(variance_x, variance_y));
  n.local = local_levels(m);
  if (m.rolling_valid != 0 &&
      from_message(m.q_rolling_vehicle, m.p_rolling_vehicle_m, &n.T_rolling_vehicle)) {
    n.map_epoch = m.map_epoch;
  }
  n.ins_age = m.age_ins_us == -1 ? Duration::zero() : sum(m.age_ins_us, Duration(0));
  n.ladar_age = sum(m.age_rolling_us, Duration(0));
  n.gps_age = sum(m.age_gps_us, Duration(0));
  *nav = n;
  return true;
}

bool read_integrity(const integrity_t& m, Stamp arrival, Integrity* integrity) {
  // Written so that NaN is rejected.
  if (!(m.protection_horizontal_m >= 0.0 && m.protection_vertical_m >= 0.0)) return false;
  *integrity = {arrival, m.validity != integrity_t::VALID_NONE, m.protection_horizontal_m,
                m.protection_vertical_m};
  return true;
}

std::optional<GpsPosition> read_fix(const gps_fix_t& m, Stamp arrival) {
  const GpsPosition fix{arrival,
                        {radians(m.lat_deg), radians(m.lon_deg), {m.height_m}},
                        std::max(m.sigma_enu_m[0], m.sigma_enu_m[1])};
  const bool null_island = m.lat_deg == 0.0 && m.lon_deg == 0.0;  // a receiver without a position
  const bool good = plausible_stamp(m.utime) && plausible(fix.antenna) && !null_island &&
                    m.fix_type > gps_fix_t::FIX_NONE && m.fix_type <= gps_fix_t::FIX_FIXED &&
                    m.sigma_enu_m[0] > 0.0 && m.sigma_enu_m[1] > 0.0 && fix.sigma_m <= 200.0;
  if (!good) return std::nullopt;
  return fix;
}

bool read_terrain(const map_patch_t& m, vj::Terrain* terrain) {
  constexpr std::int32_t kFarthestCell = 100'000'000;
  const bool good = plausible_stamp(m.utime) && m.cell_m >= 0.05 && m.cell_m <= 10.0 &&
                    m.width > 0 && m.height > 0 && m.width <= 1024 && m.height <= 1024 &&
                    m.n <= kMaxCells && m.width * m.height == m.n && m.first_i > -kFarthestCell &&
                    m.first_i < kFarthestCell && m.first_j > -kFarthestCell &&
                    m.first_j < kFarthestCell && std::abs(m.base_m) < kFarthest_m;
  if (!good) return false;
  terrain->cell_m = m.cell_m;
  terrain->first = {m.first_i, m.first_j};
  terrain->width = m.width;
  terrain->height = m.height;
  terrain->ground.resize(static_cast<std::size_t>(m.n));
  for (std::size_t k = 0; k < terrain->ground.size(); ++k) {
    vj::Ground& g = terrain->ground[k];
    const std::uint8_t flags = m.flags[k];
    g.known = (flags & map_patch_t::FLAG_UNKNOWN) == 0;
    g.obstacle = (flags & map_patch_t::FLAG_OBSTACLE) != 0;
    g.vegetation = (flags & map_patch_t::FLAG_VEGETATION) != 0;
    g.height_m = m.height_cm[k] == kUnknownHeight
                     ? std::numeric_limits<float>::quiet_NaN()
                     : static_cast<float>(m.base_m) + 0.01F * m.height_cm[k];
    g.step_m = 0.01F * m.step_cm[k];
    g.slope_rad = static_cast<float>(radians(m.slope_deg[k]));
    g.roughness_m = 0.01F * m.roughness_cm[k];
    g.off_route_m = 0.0F;
  }
  set_rises(terrain);
  return true;
}

namespace {

constexpr bool same(vj::SpeedCause cause, int limit) { return static_cast<int>(cause) == limit; }
static_assert(same(vj::SpeedCause::kTask, plan_point_t::LIMIT_TASK) &&
              same(vj::SpeedCause::kGround, plan_point_t::LIMIT_GROUND) &&
              same(vj::SpeedCause::kUnknown, plan_point_t::LIMIT_UNKNOWN) &&
              same(vj::SpeedCause::kVegetation, plan_point_t::LIMIT_VEGETATION) &&
              same(vj::SpeedCause::kClearance, plan_point_t::LIMIT_CLEARANCE) &&
              same(vj::SpeedCause::kTurn, plan_point_t::LIMIT_TURN) &&
              same(vj::SpeedCause::kSteering, plan_point_t::LIMIT_STEERING) &&
              same(vj::SpeedCause::kReverse, plan_point_t::LIMIT_REVERSE) &&
              same(vj::SpeedCause::kSight, plan_point_t::LIMIT_SIGHT) &&
              same(vj::SpeedCause::kZone, plan_point_t::LIMIT_ZONE) &&
              same(vj::SpeedCause::kUncertainty, plan_point_t::LIMIT_UNCERTAINTY) &&
              same(vj::SpeedCause::kEnd, plan_point_t::LIMIT_END));

}  // namespace

void write_plan(const Path& path, const vj::Terrain& terrain, double height_m, Stamp now,
                plan_t* plan) {
  plan->n = static_cast<std::int32_t>(path.size());
  plan->point.resize(path.size());
  double arrival_s = 0.0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const PathPoint& p = path[k];
    if (k > 0) arrival_s += (p.s_m - path[k - 1].s_m) / std::max(0.3, p.speed_mps);
    plan_point_t& out = plan->point[k];
    out.utime = to_utime(now + from_seconds(arrival_s));
    out.p_m[0] = p.place.x_m;
    out.p_m[1] = p.place.y_m;
    const vj::Ground ground = terrain.at(terrain.cell_at(p.place.x_m, p.place.y_m));
    out.p_m[2] = ground.known && std::isfinite(ground.height_m) ? ground.height_m : height_m;
    out.yaw_rad = p.place.heading_rad;
    out.speed_mps = p.direction * p.speed_mps;
    out.limit = static_cast<std::int8_t>(p.cause);
  }
}

}  // namespace rcs::bg
