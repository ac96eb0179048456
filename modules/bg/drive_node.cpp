#include "modules/bg/drive_node.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"

namespace rcs::bg {
namespace {

constexpr double kTurned_1pm = 0.04;  // of the curvature commanded
constexpr double kBeyond_m = 0.5;     // how far after the stop the predicted way is free
constexpr double kArcStep_m = 0.4;

}  // namespace

DriveCommand::DriveCommand(const BgConfig& config, Bus* bus)
    : follow_(config.follow),
      shape_(config.shape),
      rest_mps_(config.decide.rest_mps),
      accel_mps2_(config.accel_mps2),
      period_(config.period),
      valid_(config.drive_valid),
      outbox_(bus, channel::kBgDrive) {
  arc_.reserve(1024);
}

void DriveCommand::compute(const Decision& decision, const Situation& now, const Path* path,
                           std::size_t* at, Steering* steering, Stamp stamp, Report* report) {
  drive_.speed_mps = 0.0;
  drive_.accel_limit_mps2 = accel_mps2_;
  drive_.brake = decision.action == Action::kBrake ? 1 : 0;
  drive_.emergency_stop = decision.emergency ? 1 : 0;
  if (decision.action != Action::kBrake && path != nullptr) {
    *steering = follow(*path, now.place, now.nav.speed_mps, follow_, shape_, at);
    drive_.curvature_1pm = steering->curvature_1pm;
    if (decision.action == Action::kDrive) {
      keep_within_free_way(now, *path, *at, *steering, stamp, report);
    }
  }
  if (decision.action == Action::kStop) brake_if_stopping_is_late(now, path, *at, stamp, report);
  // A vehicle that turns its wheels while it drives off leaves a sharp turn by up to a metre: on a
  // way back it turns them first.
  const bool at_rest = std::abs(now.nav.speed_mps) < rest_mps_;
  const bool turns_wheels =
      at_rest && now.turns_first && std::abs(drive_.curvature_1pm - curvature_1pm_) > kTurned_1pm;
  if (turns_wheels) drive_.speed_mps = 0.0;
  // The brake is released at rest: close to an obstacle the free way does not limit the speed, as a
  // vehicle that is too close may move away.
  brakes_late_ = brakes_late_ && std::abs(now.nav.speed_mps) > rest_mps_;
  if (brakes_late_) {
    drive_.speed_mps = 0.0;
    drive_.brake = 1;
  }
  held_ = decision.action == Action::kDrive && drive_.speed_mps == 0.0 && at_rest && !turns_wheels;
  const double turn = shape_.curvature_rate * seconds(period_);
  curvature_1pm_ += std::clamp(drive_.curvature_1pm - curvature_1pm_, -turn, turn);
}

void DriveCommand::publish(bool emergency_stop, Stamp stamp) {
  drive_.utime = to_utime(stamp);
  drive_.valid_until_utime = to_utime(stamp + valid_);
  if (emergency_stop) drive_.emergency_stop = 1;
  outbox_.publish(&drive_);
}

double DriveCommand::free_m(const Situation& now, const Path& path, std::size_t at, int direction,
                            double max_m) const {
  return free_way(now.body, now.obstacles, path, at, now.place, now.nav.speed_mps, direction,
                  follow_, shape_, now.required_m, max_m);
}

void DriveCommand::keep_within_free_way(const Situation& now, const Path& path, std::size_t at,
                                        const Steering& steering, Stamp stamp, Report* report) {
  if (steering.speed_mps == 0.0) return;
  const double max_mps = std::max(std::abs(steering.speed_mps), std::abs(now.nav.speed_mps));
  const int direction = steering.speed_mps > 0.0 ? 1 : -1;
  const double free = free_m(now, path, at, direction, stopping_m(max_mps, follow_) + kBeyond_m);
  const double speed_mps = speed_within(free, now.nav.speed_mps, follow_);
  drive_.speed_mps = direction * std::min(std::abs(steering.speed_mps), speed_mps);
  if (direction * now.nav.speed_mps > 0.0) brake_if_late(free, now.nav.speed_mps, stamp, report);
}

// Who steps in front of a vehicle that is stopping anyway needs more than its gentle deceleration.
void DriveCommand::brake_if_stopping_is_late(const Situation& now, const Path* path, std::size_t at,
                                             Stamp stamp, Report* report) {
  const double v_mps = now.nav.speed_mps;
  if (std::abs(v_mps) <= rest_mps_ || !now.has_map) return;
  const int direction = v_mps > 0.0 ? 1 : -1;
  const double max_m = stopping_m(v_mps, follow_) + kBeyond_m;
  if (path == nullptr || path->size() < 2 ||
      (*path)[std::max<std::size_t>(at, 1)].direction != direction) {
    // Along the arc of the wheels as they were commanded last.
    Pose2d p = now.place;
    p.curvature_1pm = drive_.curvature_1pm;
    arc_.clear();
    for (double s_m = 0.0; s_m < max_m; s_m += kArcStep_m) {
      PathPoint point;
      point.place = p;
      point.direction = direction;
      point.s_m = s_m;
      arc_.push_back(point);
      p = along_arc(p, direction * kArcStep_m);
    }
    path = &arc_;
    at = 0;
  }
  brake_if_late(free_m(now, *path, at, direction, max_m), v_mps, stamp, report);
}

void DriveCommand::brake_if_late(double free_m, double speed_mps, Stamp stamp, Report* report) {
  if (brakes_late_ || !must_brake(free_m, speed_mps, follow_)) return;
  brakes_late_ = true;
  report->publish(stamp, event::kBgObstacleLate, "braking from {:.1f} m/s: obstacle after {:.1f} m",
                  std::abs(speed_mps), free_m);
}

}  // namespace rcs::bg
