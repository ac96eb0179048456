#include "tools/driving/speed_notes.h"

#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"

namespace rcs::driving {
namespace {

constexpr double kRest_mps = 0.1;
constexpr double kSlower_mps = 0.3;

}  // namespace

SpeedNotes::SpeedNotes(Bus* bus)
    : plans_(bus, channel::kBgPlan, [this](const plan_t& m, Stamp) { accept(m); }),
      nav_states_(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp) { accept(m); }),
      drives_(bus, channel::kBgDrive, [this](const drive_t& m, Stamp) { drive_ = m; }) {}

void SpeedNotes::accept(const plan_t& m) {
  plan_ = m;
  at_ = 0;
}

void SpeedNotes::accept(const nav_state_t& m) {
  if (nav_utime_ != 0 && plan_.n > 0) {
    limited_s_[limit_of(m)] += 1e-6 * static_cast<double>(m.utime - nav_utime_);
  }
  nav_utime_ = m.utime;
}

std::string SpeedNotes::limit_of(const nav_state_t& m) {
  const double speed_mps = from_message(m.v_world_mps).norm();
  const double commanded_mps = std::abs(drive_.speed_mps);
  if (commanded_mps < kRest_mps && speed_mps < kRest_mps) return "at rest";
  const Vec2 here = from_message(m.p_local_vehicle_m).head<2>();
  const auto away_m = [&](std::size_t k) {
    return (from_message(plan_.point[k].p_m).head<2>() - here).norm();
  };
  while (at_ + 1 < plan_.point.size() && away_m(at_ + 1) <= away_m(at_)) ++at_;
  const plan_point_t& point = plan_.point[at_];
  if (commanded_mps < std::abs(point.speed_mps) - kSlower_mps) return "obstacle ahead";
  if (speed_mps < commanded_mps - kSlower_mps) return "acceleration";
  return std::string(speed_limit_name(point.limit));
}

}  // namespace rcs::driving
