#pragma once
// Ground that the LADAR should see from where the vehicle is, and does not: it is hidden by an
// edge. Beyond a crest it comes into sight; below a drop and in a ditch it does not. It is an
// obstacle until it is seen.

#include <cstdint>

#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/grid.h"

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

/// A place on the ground as seen from the LADAR.
struct Bearing {
  double range_m = 0.0;
  double angle_rad = 0.0;  ///< counter-clockwise from ahead, within [-pi, pi]
};
[[nodiscard]] Bearing bearing_from_ladar(double x_m, double y_m, const Place& vehicle,
                                         const SightParams& params);
/// Range within which the lowest rays pass above level ground.
/// @param lifted_rad  the lowest rays, by the attitude of the vehicle
[[nodiscard]] double blind_zone_m(const SightParams& params, double lifted_rad);
/// Within the range and the angles in which the LADAR shows all ground, or in its blind zone there.
[[nodiscard]] bool is_in_sight(const Bearing& to, const SightParams& params);

class HiddenGround {
 public:
  explicit HiddenGround(const SightParams& params) : params_(params) {}

  /// Marks hidden ground as obstacles, also where it was found earlier and is still unknown.
  /// @param pitch_rad  of the vehicle, positive nose up: it lifts the lowest ray
  /// @param roll_rad  lifts it on one side
  /// @param looked  the terrain has a new scan from about here: what it did not see is counted
  void mark(const Place& vehicle, double pitch_rad, double roll_rad, bool looked,
            vj::Terrain* terrain);
  /// Another frame local has begun.
  void clear() { hidden_.clear(); }

 private:
  SightParams params_;
  Grid<std::uint8_t> hidden_{512, 0.4};  // scans that should have seen the cell
};

}  // namespace rcs::bg
