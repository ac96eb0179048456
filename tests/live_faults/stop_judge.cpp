#include "tests/live_faults/stop_judge.h"

#include <fmt/format.h>

#include <cmath>

namespace rcs::live_faults {
namespace {

constexpr std::size_t kMaxBreaches = 20;
constexpr double kAtRest_mps = 0.3;  // BG's limit is 0.15 by WM's velocity
constexpr double kMoving_mps = 0.5;

}  // namespace

void StopJudge::breach(const std::string& text) {
  if (breaches_.size() < kMaxBreaches) breaches_.push_back(text);
}

void StopJudge::note_publisher(std::int64_t publisher_id, Stamp now) {
  if (publisher_id == bg_) return;
  if (bg_ != 0) law_.restarted(boot_id_, true);
  bg_ = publisher_id;
  note_change(now);
}

void StopJudge::note_change(Stamp now) {
  if (law_.in_force().empty()) {
    stopped_.reset();
    rest_world_.reset();
    brakes_ = false;
  } else if (!stopped_) {
    stopped_ = now;
    if (speed_mps_ > kMoving_mps) ++stops_in_motion_;
  }
}

void StopJudge::take(const command_t& m, Stamp arrival) {
  law_.take(m, arrival);
  note_change(arrival);
}

void StopJudge::take(const drive_t& m, Stamp arrival) {
  note_publisher(m.publisher_id, arrival);
  // The cycle of an earlier one began before the stop arrived.
  if (!stopped_ || from_utime(m.utime) < *stopped_) return;
  const bool brakes = m.brake == 1 && m.speed_mps == 0.0 && m.emergency_stop == 1;
  if (brakes && !brakes_) {
    brakes_ = true;
    latencies_ms_.push_back(milliseconds(arrival - *stopped_));
  }
  if (brakes) return;
  const std::string what = fmt::format("brake {}, {:.2f} m/s, emergency_stop {}", m.brake,
                                       m.speed_mps, m.emergency_stop);
  if (brakes_) breach(fmt::format("{}: after the full brake of a stop in force", what));
  if (!brakes_ && arrival - *stopped_ > kBrakeWithin) {
    breach(fmt::format("{}: {:.2f} s after a stop", what, seconds(arrival - *stopped_)));
  }
}

void StopJudge::take(const status_t& m, Stamp arrival) {
  note_publisher(m.publisher_id, arrival);
  law_.take(m, arrival, speed_mps_ < kAtRest_mps);
  for (const std::int64_t id : law_.lost()) {
    breach(fmt::format("the stop {:x} of {} has ended at {:.2f} m/s without a release", id,
                       law_.in_force().at(id).issuer, speed_mps_));
  }
  note_change(arrival);
}

void StopJudge::take(const truth_t& m) {
  speed_mps_ = std::hypot(m.v_world_mps[0], m.v_world_mps[1]);
  place_world_ = {m.p_world_vehicle_m[0], m.p_world_vehicle_m[1]};
  if (!stopped_ || !brakes_) return;
  if (!rest_world_ && speed_mps_ < kRest_mps) rest_world_ = place_world_;
  const double moved_m = rest_world_ ? (place_world_ - *rest_world_).norm() : 0.0;
  if (moved_m > kMoved_m) {
    breach(fmt::format("moved by {:.2f} m while a stop is in force", moved_m));
    rest_world_ = place_world_;
  }
}

}  // namespace rcs::live_faults
