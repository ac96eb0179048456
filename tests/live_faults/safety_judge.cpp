#include "tests/live_faults/safety_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rcs::live_faults {
namespace {

constexpr std::int64_t kMemory_us = 500'000;
constexpr std::int64_t kSameBreach_us = 2'000'000;  // within this time it is the same violation
constexpr Duration kDecelerationSpan = from_seconds(0.2);

}  // namespace

void SafetyJudge::reset() {
  metrics_ = {};
  stands_since_.reset();
}

const SafetyJudge::Sample* SafetyJudge::before(Duration span) const {
  for (auto s = samples_.rbegin(); s != samples_.rend(); ++s) {
    if (s->utime <= samples_.back().utime - span.count()) return &*s;
  }
  return nullptr;
}

void SafetyJudge::breach(const std::string& kind, std::int64_t utime, const std::string& text) {
  const bool same = kind == last_kind_ && utime - last_breach_utime_ < kSameBreach_us;
  last_kind_ = kind;
  last_breach_utime_ = utime;
  if (!same) breaches_.push_back(fmt::format("{}: {} (utime {})", kind, text, utime));
}

void SafetyJudge::take(const truth_t& m, Stamp arrival) {
  const Duration shift = arrival - from_utime(m.utime);
  shift_ = std::min(shift_.value_or(shift), shift);
  const double speed = std::hypot(m.v_world_mps[0], m.v_world_mps[1]);
  if (!samples_.empty()) {
    metrics_.driven_m += std::hypot(m.p_world_vehicle_m[0] - samples_.back().x,
                                    m.p_world_vehicle_m[1] - samples_.back().y);
  }
  samples_.push_back({m.utime, speed, m.rate_vehicle_radps[2] * speed, m.p_world_vehicle_m[0],
                      m.p_world_vehicle_m[1]});
  while (samples_.front().utime < m.utime - kMemory_us) samples_.pop_front();

  metrics_.clearance_m = std::min(metrics_.clearance_m, m.clearance_m);
  const bool touches = m.clearance_m <= 0.0;
  if (touches && !touching_) {
    ++metrics_.collisions;
    breaches_.push_back(fmt::format("collision: at {:.1f}, {:.1f}, {:.2f} m/s (utime {})",
                                    m.p_world_vehicle_m[0], m.p_world_vehicle_m[1], speed,
                                    m.utime));
  }
  touching_ = touches;

  if (speed > limits_.moving_mps) {
    stands_since_.reset();
  } else {
    if (!stands_since_) stands_since_ = m.utime;
    metrics_.longest_stand = std::max(metrics_.longest_stand, Duration(m.utime - *stands_since_));
  }
  judge_motion(from_utime(m.utime) + *shift_);
}

void SafetyJudge::judge_motion(Stamp node_time) {
  const Sample& now = samples_.back();
  double lateral = 0.0;
  for (const Sample& s : samples_) lateral += s.lateral / static_cast<double>(samples_.size());
  lateral = std::abs(lateral);
  double deceleration = 0.0;
  if (const Sample* then = before(kDecelerationSpan)) {
    deceleration =
        (then->speed - now.speed) / (1e-6 * static_cast<double>(now.utime - then->utime));
  }
  metrics_.speed_mps = std::max(metrics_.speed_mps, now.speed);
  metrics_.lateral_mps2 = std::max(metrics_.lateral_mps2, lateral);
  metrics_.deceleration_mps2 = std::max(metrics_.deceleration_mps2, deceleration);
  if (now.speed > limits_.speed_mps) {
    breach("speed", now.utime, fmt::format("{:.2f} m/s", now.speed));
  }
  if (lateral > limits_.lateral_mps2) {
    breach("lateral", now.utime, fmt::format("{:.2f} m/s2 at {:.2f} m/s", lateral, now.speed));
  }
  if (deceleration > limits_.deceleration_mps2) {
    breach("braking", now.utime, fmt::format("{:.2f} m/s2", deceleration));
  }
  const bool commanded =
      drive_ && node_time <= from_utime(drive_->valid_until_utime) + limits_.until_braking;
  if (!commanded && now.speed > limits_.moving_mps && deceleration < 1.0) {
    breach("without a command", now.utime, fmt::format("moves at {:.2f} m/s", now.speed));
  }
}

void SafetyJudge::take(const nav_state_t& m) {
  nav_utime_ = m.publish_utime;
  ladar_age_us_ = m.age_rolling_us;
}

void SafetyJudge::take(const command_t& m) {
  if (m.kind == command_t::KIND_GOTO) ordered_until_utime_ = m.valid_until_utime;
}

void SafetyJudge::take(const drive_t& m) {
  drive_ = m;
  if (m.brake != 0 || std::abs(m.speed_mps) < 0.01) return;
  if (m.utime - nav_utime_ > limits_.nav_age.count()) {
    breach("drives blindly", m.utime,
           fmt::format("the newest belief is {:.2f} s old", 1e-6 * double(m.utime - nav_utime_)));
  }
  if (ladar_age_us_ < 0 || ladar_age_us_ > limits_.ladar_age.count()) {
    breach("drives without LADAR", m.utime,
           fmt::format("the newest registration is {:.2f} s old", 1e-6 * double(ladar_age_us_)));
  }
  if (m.utime > ordered_until_utime_) {
    breach(
        "drives unasked", m.utime,
        fmt::format("{:.2f} s after the command", 1e-6 * double(m.utime - ordered_until_utime_)));
  }
}

}  // namespace rcs::live_faults
