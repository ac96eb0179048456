#include "tools/driving/alert_notes.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "modules/bg/bg_messages_node.h"

namespace rcs::driving {
namespace {

constexpr double kMoves_mps = 0.15;
// From the message of WM to the brakes: a cycle of each node, and the delay of the actuators.
constexpr double kReaction_s = 0.5;
constexpr double kSlack_m = 0.3;
constexpr double kSlack_mps = 0.05;
constexpr double kDrivePeriod_s = 0.05;

}  // namespace

AlertNotes::AlertNotes(Bus* bus, std::int8_t frame, const vj::SpeedParams& limits, double task_mps,
                       double braking_mps2)
    : in_world_(frame == command_t::FRAME_WORLD),
      vehicle_(limits),
      limits_(limits),
      task_mps_(task_mps),
      braking_mps2_(braking_mps2),
      commands_(bus, channel::kBgCommand, [this](const command_t& m, Stamp) { accept(m); }),
      levels_(bus, channel::kWmIntegrity, [this](const integrity_t& m, Stamp) { accept(m); }),
      nav_states_(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp) { accept(m); }),
      truth_(bus, channel::kSimTruth, [this](const truth_t& m, Stamp) { accept(m); }),
      drive_(bus, channel::kBgDrive, [this](const drive_t& m, Stamp) { accept(m); }) {}

double AlertNotes::allowed_share() const {
  const std::size_t known = std::min(count_, shares_.size());
  return known == 0 ? 1.0
                    : *std::max_element(shares_.begin(),
                                        shares_.begin() + static_cast<std::ptrdiff_t>(known));
}

void AlertNotes::accept(const command_t& m) {
  if (m.kind != command_t::KIND_GOTO) return;
  const bool in_world = m.frame == command_t::FRAME_WORLD;
  if (in_world != in_world_) {
    // The levels so far are those of another frame.
    count_ = 0;
    beyond_ = false;
  }
  in_world_ = in_world;
  limits_ = vehicle_;
  const auto narrow = [](double asked_m, double* limit_m) {
    if (asked_m > 0.0) *limit_m = std::min(*limit_m, asked_m);
  };
  narrow(m.alert_limit_horizontal_m, &limits_.alert_limit_horizontal_m);
  narrow(m.alert_limit_vertical_m, &limits_.alert_limit_vertical_m);
  task_mps_ = 0.0;
  for (const waypoint_t& w : m.waypoint) task_mps_ = std::max(task_mps_, w.speed_mps);
}

void AlertNotes::accept(const integrity_t& m) {
  if (!in_world_ || m.validity != integrity_t::VALID_WORLD) return;  // BG is in a state of its own
  take_levels(m.protection_horizontal_m, m.protection_vertical_m);
}

void AlertNotes::accept(const nav_state_t& m) {
  constexpr std::int64_t kEvery_us = 100'000;  // as WM_INTEGRITY
  bg::Nav nav;
  if (in_world_ || m.utime - nav_utime_ < kEvery_us || !bg::read_nav(m, Stamp::min(), &nav)) return;
  nav_utime_ = m.utime;
  take_levels(nav.local.horizontal_m, nav.local.vertical_m);
}

void AlertNotes::take_levels(double horizontal_m, double vertical_m) {
  const double share = vj::protected_share(horizontal_m, vertical_m, limits_);
  shares_[count_++ % shares_.size()] = share;
  if (share > 0.0) {
    beyond_ = false;
  } else if (!beyond_) {
    beyond_ = true;
    is_late_ = false;
    way_m_ = 0.0;
    began_mps_ = -1.0;
  }
}

void AlertNotes::accept(const truth_t& m) {
  const double since_s =
      truth_utime_ == 0 ? 0.0 : 1e-6 * static_cast<double>(m.utime - truth_utime_);
  truth_utime_ = m.utime;
  if (!beyond_) return;
  const double speed_mps = from_message(m.v_world_mps).head<2>().norm();
  if (began_mps_ < 0.0) {
    began_mps_ = speed_mps;
    outcome_.crossings += speed_mps > kMoves_mps ? 1 : 0;
  }
  way_m_ += speed_mps > kMoves_mps ? speed_mps * since_s : 0.0;
  outcome_.beyond_s += since_s;
  outcome_.beyond_m = std::max(outcome_.beyond_m, way_m_);
  const double stop_m =
      began_mps_ * kReaction_s + 0.5 * began_mps_ * began_mps_ / braking_mps2_ + kSlack_m;
  if (way_m_ > stop_m && !is_late_) {
    is_late_ = true;
    ++outcome_.late;
  }
}

void AlertNotes::accept(const drive_t& m) {
  const double share = allowed_share();
  if (share >= 1.0) return;
  if (share > 0.0) outcome_.slowed_s += kDrivePeriod_s;
  const bool fast = std::abs(m.speed_mps) > share * task_mps_ + kSlack_mps;
  if (fast && m.brake == 0) outcome_.too_fast_s += kDrivePeriod_s;
}

}  // namespace rcs::driving
