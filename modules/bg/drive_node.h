#pragma once
// From the path and the decision of a cycle to BG_DRIVE: steering, speed, and the brake for what
// lies on the predicted way.

#include <cstddef>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/latency_trace_t.hpp"
#include "modules/bg/bg_config.h"
#include "modules/bg/bg_messages_node.h"
#include "modules/bg/decide.h"
#include "modules/bg/path_follow.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"

namespace rcs::bg {

class DriveCommand {
 public:
  DriveCommand(const BgConfig& config, Bus* bus);

  /// What is known of the vehicle and the ground in this cycle.
  struct Situation {
    const Nav& nav;
    Pose2d place;  ///< with the curvature of the wheels, curvature_1pm()
    const Body& body;
    const ObstacleDistance& obstacles;
    bool has_map = false;      ///< obstacles are those of now
    double required_m = 0.0;   ///< distance from obstacles
    bool turns_first = false;  ///< at rest, the wheels are turned before the vehicle drives off
  };

  /// Computes the command of a cycle; publish() follows.
  /// @param path  nullptr: none is known in the present frame local
  /// @param at  see follow()
  /// @param steering  along the path, if it is followed
  void compute(const Decision& decision, const Situation& now, const Path* path, std::size_t* at,
               Steering* steering, Stamp stamp, Report* report);
  void publish(bool emergency_stop, Stamp stamp);

  /// The vehicle is to drive, and stands because an obstacle is too near.
  [[nodiscard]] bool is_held() const { return held_; }
  /// Of the wheels, estimated from the commands and the steering rate.
  [[nodiscard]] double curvature_1pm() const { return curvature_1pm_; }
  /// Of the newest input that the command depends on.
  [[nodiscard]] latency_trace_t& latency_trace() { return drive_.latency_trace; }

 private:
  /// Commands a speed from which the vehicle stops before any obstacle on its predicted way, or the
  /// brake.
  void keep_within_free_way(const Situation& now, const Path& path, std::size_t at,
                            const Steering& steering, Stamp stamp, Report* report);
  /// Of a vehicle that is to stop gently: commands the brake for an obstacle that needs it.
  void brake_if_stopping_is_late(const Situation& now, const Path* path, std::size_t at,
                                 Stamp stamp, Report* report);
  void brake_if_late(double free_m, double speed_mps, Stamp stamp, Report* report);
  [[nodiscard]] double free_m(const Situation& now, const Path& path, std::size_t at, int direction,
                              double max_m) const;

  FollowParams follow_;
  Shape shape_;
  double rest_mps_;
  double accel_mps2_;
  Duration period_;
  Duration valid_;
  Outbox<drive_t> outbox_;
  drive_t drive_{};
  Path arc_;  // of the wheels as they are
  double curvature_1pm_ = 0.0;
  bool brakes_late_ = false;  // for an obstacle that was detected late
  bool held_ = false;
};

}  // namespace rcs::bg
