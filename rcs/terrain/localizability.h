#pragma once
// How well the ground's shape alone tells where one is: the information of a scan that is matched
// to a map, without a scan.

#include <vector>

#include "rcs/base/linear.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs {

struct LocalizabilityParams {
  double radius_m = 25.0;    ///< of a disc of ground that a scan sees, [5, 200]. A Demo III scan of
                             ///< 90 deg that reaches 60 m in the open sees as much
  double column_m = 2.0;     ///< one height each, as SP's columns, [0.5, 20]
  double min_sigma_m = 0.1;  ///< no height counts for more, [0.001, 10]
  double tilt_sigma_rad = radians(0.2);     ///< roll and pitch are known from gravity to this
  double heading_sigma_rad = radians(0.3);  ///< and heading
};

/// What one scan at a place tells of east and north, in 1/m^2, height being unknown: the Schur
/// complement of the 6x6 information of heights z(x, y) with the map's gradients. Heights of one
/// map cell share its error and count once. Zero on a plane, and where the map knows nothing.
[[nodiscard]] Eigen::Matrix2d terrain_information(const ElevationMap& map, const Vec2& place_m,
                                                  const LocalizabilityParams& params);

/// Standard deviation along the worst direction, of one scan alone; infinite without information.
[[nodiscard]] double worst_sigma_m(const Eigen::Matrix2d& information);

struct PathUncertainty {
  double way_m = 0.0;                   ///< driven since the start
  Vec2 place_m = Vec2::Zero();          ///< in the map's frame
  double sigma_dead_reckoning_m = 0.0;  ///< worst direction, by motion alone
  double sigma_with_map_m = 0.0;        ///< and with matches to the map
};

struct DeadReckoning {
  double start_sigma_m = 0.3;  ///< of the place when GPS goes, each axis, [0.001, 1000]
  double drift = 0.002;        ///< sigma of the error a metre driven, each axis, (0, 1]
};

/// How sure along a path, were GPS to go at its start, a place at a time. The motion's error grows
/// with the way (a constant rate, not known), and at each place a match to the map is fused.
class PathUncertaintyWalk {
 public:
  /// Any walk before is over. Allocates when the path is longer than any before.
  /// @param path_m  two places or more
  /// @param step_m  of way from place to place, > 0: as far as a scan sees, or more, as nearer
  ///   matches would see the same cells with the same errors
  void begin(const std::vector<Vec2>& path_m, double step_m, const DeadReckoning& motion);

  /// Paths of so many places allocate nothing.
  void reserve(std::size_t places) { path_m_.reserve(places); }

  /// The path is at its end, or none was begun.
  [[nodiscard]] bool over() const { return leg_ + 1 >= path_m_.size(); }
  /// Where the next match is; of a walk that is not over.
  [[nodiscard]] const Vec2& place() const { return place_m_; }
  /// Fuses it and goes on to the next.
  /// @param information  of east and north there [1/m^2], may be singular or zero
  [[nodiscard]] PathUncertainty step(const Eigen::Matrix2d& information);

 private:
  void find_place();

  std::vector<Vec2> path_m_;
  double step_m_ = 0.0;
  std::size_t leg_ = 0;     // from path_m_[leg_] to the next
  double leg_way_m_ = 0.0;  // driven at its begin
  double way_m_ = 0.0;      // of the next place
  Vec2 place_m_ = Vec2::Zero();
  Eigen::Matrix4d dead_ = Eigen::Matrix4d::Zero();  // of the place's error, and its growth a metre
  Eigen::Matrix4d with_map_ = Eigen::Matrix4d::Zero();
};

/// All of such a walk, a match each `radius_m`. The survey's slow error is not in it.
/// @param path_m  places in the map's frame, two or more
[[nodiscard]] std::vector<PathUncertainty> path_uncertainty_along(
    const ElevationMap& map, const std::vector<Vec2>& path_m, const DeadReckoning& motion,
    const LocalizabilityParams& params);

}  // namespace rcs
