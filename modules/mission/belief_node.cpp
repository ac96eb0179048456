#include "modules/mission/belief_node.h"

#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/local_levels.h"
#include "lcmtypes/plausible.h"

namespace rcs::mission {
namespace {

constexpr int kNavStates = 128;  // of a period of up to 1 s: the way is noted from all of them

Geodetic geodetic(const Vec3& datum_deg) {
  return {radians(datum_deg.x()), radians(datum_deg.y()), {datum_deg.z()}};
}

}  // namespace

LocalFrame frame_at(const Vec3& datum_deg) { return LocalFrame(geodetic(datum_deg)); }

BeliefInput::BeliefInput(Bus* bus)
    : nav_states_(bus, channel::kWmNavState, kNavStates),
      integrities_(bus, channel::kWmIntegrity, 1) {}

void BeliefInput::take(Stamp now, bool notes_way, WayBack* way, Report* report) {
  datum_is_new_ = false;
  T_world_before_ = Pose();
  for (; !nav_states_.empty(); nav_states_.pop()) {
    const nav_state_t& m = *nav_states_.front();
    Pose T_world_vehicle;
    if (!plausible_motion(m) ||
        !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle)) {
      report->publish(now, event::kMissionInputRejected, "{} rejected: pose or velocity invalid",
                      channel::kWmNavState);
      continue;
    }
    belief_.arrival = nav_states_.front_arrival();
    belief_.pose_valid =
        m.pose_valid != 0 && m.mode != nav_state_t::MODE_ALIGN && m.mode != nav_state_t::MODE_LOST;
    belief_.world_valid = m.world_valid != 0;
    belief_.T_world_vehicle = T_world_vehicle;
    belief_.own_map_m = local_levels(m).horizontal_m;
    belief_.sigma_world_m = std::sqrt(horizontal_variance(m.cov_world_pose, T_world_vehicle));
    belief_.gps_age = m.age_gps_us < 0 ? Duration::max() : Duration(m.age_gps_us);
    belief_.here = {from_message(m.p_rolling_vehicle_m), m.rolling_valid != 0 ? m.map_epoch : -1,
                    T_world_vehicle.p, belief_.world_valid};
    if (belief_.world_valid) {
      take_datum(Vec3(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m), way);
    }
    if (belief_.pose_valid && notes_way) way->note(belief_.here);
  }
  for (; !integrities_.empty(); integrities_.pop()) {
    const integrity_t& m = *integrities_.front();
    // Written so that NaN is rejected.
    if (!(m.protection_horizontal_m >= 0.0)) {
      report->publish(now, event::kMissionInputRejected, "{} rejected: protection level invalid",
                      channel::kWmIntegrity);
      continue;
    }
    belief_.level_m = m.validity == integrity_t::VALID_WORLD
                          ? m.protection_horizontal_m
                          : std::numeric_limits<double>::infinity();
  }
}

// Without a configured datum a restarted WM begins another frame world.
void BeliefInput::take_datum(const Vec3& datum_deg, WayBack* way) {
  if (belief_.datum && *belief_.datum == datum_deg) return;
  if (!plausible(geodetic(datum_deg))) return;
  if (belief_.datum) {
    const Pose T_now_before = frame_at(datum_deg).from(frame_at(*belief_.datum));
    way->move_world(T_now_before);
    T_world_before_ = T_now_before * T_world_before_;
  }
  belief_.datum = datum_deg;
  datum_is_new_ = true;
}

}  // namespace rcs::mission
