#pragma once
// Ground that the LADAR should see from where the vehicle is, and does not: it is hidden by an
// edge. Beyond a crest it comes into sight; below a drop and in a ditch it does not. It is an
// obstacle until it is seen.

#include <cmath>
#include <cstdint>

#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/grid.h"
#include "rcs/base/linear.h"

namespace rcs::bg {

struct SightParams {
  double height_m = 1.8;              ///< of the LADAR above the ground
  double lowest_rad = radians(20.0);  ///< of its rays, below the horizon of the vehicle
  double ahead_m = 1.0;               ///< of the LADAR before the origin of the vehicle frame
  /// Up to here the rows of the LADAR meet the ground closer than a cell; 0: unknown, nothing
  /// counts as hidden.
  double far_m = 0.0;
  double half_angle_rad = radians(36.0);  ///< to either side
};

/// Positions on the ground relative to the LADAR of a vehicle.
class LadarView {
 public:
  LadarView(const Pose2d& vehicle, const SightParams& params)
      : params_(params),
        vehicle_(vehicle.x_m, vehicle.y_m),
        ahead_(std::cos(vehicle.heading_rad), std::sin(vehicle.heading_rad)) {}

  /// @return ahead and to the left of the LADAR
  [[nodiscard]] Vec2 relative(double x_m, double y_m) const {
    const Vec2 d = Vec2(x_m, y_m) - vehicle_;
    return {ahead_.dot(d) - params_.ahead_m, ahead_.x() * d.y() - ahead_.y() * d.x()};
  }
  /// Within SightParams::far_m and the field of view.
  [[nodiscard]] bool covers(const Vec2& relative) const {
    return relative.norm() < params_.far_m &&
           std::abs(std::atan2(relative.y(), relative.x())) < params_.half_angle_rad;
  }

 private:
  SightParams params_;
  Vec2 vehicle_;
  Vec2 ahead_;
};

/// Range within which the lowest rays pass above level ground.
/// @param lifted_rad  the lowest rays, by the attitude of the vehicle
[[nodiscard]] double blind_zone_m(const SightParams& params, double lifted_rad);

class HiddenGround {
 public:
  explicit HiddenGround(const SightParams& params) : params_(params) {}

  /// Marks hidden ground as obstacles, also where it was found earlier and is still unknown.
  /// @param pitch_rad  of the vehicle, positive nose up: it lifts the lowest ray
  /// @param roll_rad  lifts it on one side
  /// @param looked  the terrain has a new scan from about here: what it did not see is counted
  void mark(const Pose2d& vehicle, double pitch_rad, double roll_rad, bool looked,
            vj::Terrain* terrain);
  /// Another frame local has begun.
  void clear() { hidden_.clear(); }

 private:
  SightParams params_;
  Grid<std::uint8_t> hidden_{512, 0.4};  // scans that should have seen the cell
};

}  // namespace rcs::bg
