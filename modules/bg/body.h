#pragma once
// The outline of the vehicle on the map of obstacles.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"

namespace rcs::bg {

/// Nine discs that cover the outline: three along the middle, three at each end. They extend beyond
/// it by 0.05 m at the sides and by 0.14 m at the ends (3.2 by 2 m). With three large discs along
/// the middle the clearance of an obstacle next to the vehicle changed by 0.13 m while the vehicle
/// passed it: a vehicle close to one could neither move on nor back.
class Body {
 public:
  /// @param exact_m  larger clearances affect nothing: clearance() may return less
  Body(const Shape& shape, double exact_m) : exact_m_(exact_m) {
    const double half_length_m = 0.5 * shape.length_m;
    const double half_width_m = 0.5 * shape.width_m;
    const double middle_m = 0.6 * half_length_m;  // half of the part that the middle discs cover
    middle_radius_m_ = std::hypot(half_width_m, middle_m / 3.0);
    end_radius_m_ = std::hypot(0.5 * (half_length_m - middle_m), half_width_m / 3.0);
    const double end_m = 0.5 * (half_length_m + middle_m);
    std::size_t k = 0;
    for (const double share : {-2.0 / 3.0, 0.0, 2.0 / 3.0}) {
      middle_m_[k] = share * middle_m;
      ends_[2 * k] = {end_m, share * half_width_m};
      ends_[2 * k + 1] = {-end_m, share * half_width_m};
      ++k;
    }
    around_m_ = std::hypot(half_length_m, half_width_m);
  }

  /// From the body at this pose to the nearest obstacle; <= 0: contact. Outside the terrain there
  /// are no obstacles.
  [[nodiscard]] double clearance(const ObstacleDistance& obstacles, const Pose2d& place) const {
    return clearance_by([&](double x_m, double y_m) { return obstacles.at(x_m, y_m); }, place);
  }

  /// The same by any distance of points, distance_at(x_m, y_m).
  template <class Distance>
  [[nodiscard]] double clearance_by(Distance&& distance_at, const Pose2d& place) const {
    const double around_m = distance_at(place.x_m, place.y_m) - around_m_;
    if (around_m >= exact_m_) return around_m;
    const double c = std::cos(place.heading_rad);
    const double s = std::sin(place.heading_rad);
    const auto at = [&](double ahead_m, double left_m) {
      return distance_at(place.x_m + c * ahead_m - s * left_m,
                         place.y_m + s * ahead_m + c * left_m);
    };
    double middle_m = std::numeric_limits<double>::infinity();
    for (const double ahead_m : middle_m_) middle_m = std::min(middle_m, at(ahead_m, 0.0));
    double ends_m = std::numeric_limits<double>::infinity();
    for (const Offset& o : ends_) ends_m = std::min(ends_m, at(o.ahead_m, o.left_m));
    return std::min(middle_m - middle_radius_m_, ends_m - end_radius_m_);
  }

  /// Half of its width: no heading brings its centre nearer to an obstacle.
  [[nodiscard]] double radius_m() const { return middle_radius_m_; }

 private:
  struct Offset {
    double ahead_m, left_m;
  };
  std::array<double, 3> middle_m_{};
  std::array<Offset, 6> ends_{};
  double exact_m_;
  double middle_radius_m_;
  double end_radius_m_;
  double around_m_;
};

}  // namespace rcs::bg
