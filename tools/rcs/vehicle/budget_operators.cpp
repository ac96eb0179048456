#include "tools/rcs/vehicle/budget_operators.h"

#include <algorithm>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"

namespace rcs::cli {
namespace {

constexpr char kIssuer[] = "budget";
constexpr Duration kRefresh = from_seconds(1.0);
constexpr double kAhead_m = 30.0;
// The mission reports once a second: a command must not be replaced before its echo.
constexpr Duration kRefreshTask = from_seconds(4.0);
constexpr Duration kTask = from_seconds(30.0);  // up to half of it is the search
constexpr double kAround_m = 100.0;
constexpr double kLeastAround_m = 10.0;

}  // namespace

BudgetOperator::BudgetOperator(Bus* bus)
    : port_(bus, channel::kBgCommand, channel::kBgStop, channel::kBgStatus, kIssuer, {}) {}

void BudgetOperator::take(const nav_state_t& m) {
  (void)from_message(m.q_local_vehicle, m.p_local_vehicle_m, &T_local_vehicle_);
}

void BudgetOperator::step(Stamp now) {
  port_.step(now);
  if (now < next_send_) return;
  const bool near = (T_local_vehicle_.p - goal_).head<2>().norm() < 0.5 * kAhead_m;
  if (near || command_.waypoints.empty()) {
    goal_ = T_local_vehicle_ * Vec3(kAhead_m, 0.0, 0.0);
    waypoint_t w{};
    to_message(goal_, w.p_m);
    w.radius_m = 3.0;
    w.speed_mps = 8.0;
    command_.kind = command_t::KIND_GOTO;
    command_.frame = command_t::FRAME_LOCAL;
    command_.waypoints = {w};
    ++command_.task;
  }
  port_.send(command_, now);
  next_send_ = now + kRefresh;
}

BudgetMission::BudgetMission(Bus* bus)
    : port_(bus, channel::kMissionCommand, channel::kBgStop, channel::kMissionStatus, kIssuer, {}),
      around_m_(kAround_m) {
  task_.kind = command_t::KIND_GOTO;
  task_.frame = command_t::FRAME_WORLD;
  task_.valid_for = 3 * kRefreshTask;
}

void BudgetMission::take(const nav_state_t& m) {
  world_known_ =
      m.world_valid != 0 && from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle_);
}

void BudgetMission::step(Stamp now) {
  port_.step(now);
  const status_t* const status = port_.status();
  const bool impossible = status != nullptr && port_.confirmed() && status->issuer == kIssuer &&
                          (status->state == "NO_ROUTE" || status->state == "REFUSED");
  if (world_known_ && (now >= next_task_ || impossible)) {
    if (impossible) around_m_ = std::max(kLeastAround_m, 0.5 * around_m_);
    task_.waypoints.clear();
    for (const Vec2& side : {Vec2(1.0, 0.0), Vec2(0.0, 1.0), Vec2(-1.0, 0.0), Vec2(0.0, -1.0)}) {
      const Vec2 p = T_world_vehicle_.p.head<2>() + around_m_ * side;
      waypoint_t w{};
      to_message(Vec3(p.x(), p.y(), 0.0), w.p_m);
      w.radius_m = 3.0;
      w.speed_mps = 8.0;
      task_.waypoints.push_back(w);
    }
    ++task_.task;
    next_task_ = now + kTask;
    next_send_ = now;
  }
  if (task_.waypoints.empty() || now < next_send_) return;
  port_.send(task_, now);
  next_send_ = now + kRefreshTask;
}

}  // namespace rcs::cli
