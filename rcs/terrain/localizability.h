#pragma once
// Localizability: the information about the horizontal position that a scan matched to a map would
// give, computed from the relief of the map alone.

#include <vector>

#include "rcs/base/linear.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs {

struct LocalizabilityParams {
  double radius_m = 25.0;    ///< of a disc of ground visible in a scan, [5, 200]. A Demo III scan
                             ///< of 90 deg with 60 m range covers about this area
  double column_m = 2.0;     ///< one height for each, as in the columns of SP, [0.5, 20]
  double min_sigma_m = 0.1;  ///< lower bound of the sigma of a height, [0.001, 10]
  double tilt_sigma_rad = radians(0.2);     ///< of roll and pitch, known from gravity
  double heading_sigma_rad = radians(0.3);  ///< of heading
};

/// Information of one scan about east and north at a position [1/m^2], with unknown height: the
/// Schur complement of the 6x6 information of heights z(x, y) with the map's gradients. Heights of
/// one map cell share its error and count once; slopes that the errors of the heights cause do not
/// count (docs/adr/0045-slopes-from-map-errors.md). Zero on a plane, and where the map has no data.
[[nodiscard]] Eigen::Matrix2d terrain_information(const ElevationMap& map, const Vec2& place_m,
                                                  const LocalizabilityParams& params);

/// Standard deviation along the worst direction, of one scan alone; infinite without information.
[[nodiscard]] double worst_sigma_m(const Eigen::Matrix2d& information);

struct PathUncertainty {
  double travelled_m = 0.0;             ///< distance from the start
  Vec2 place_m = Vec2::Zero();          ///< in the map's frame
  double sigma_dead_reckoning_m = 0.0;  ///< worst direction, without matches
  double sigma_with_map_m = 0.0;        ///< and with matches to the map
};

struct DeadReckoning {
  double start_sigma_m = 0.3;  ///< position at GPS failure, each axis, [0.001, 1000]
  double drift = 0.002;        ///< sigma of the error per metre, each axis, (0, 1]
};

/// Predicted uncertainty along a path if GPS fails at its start, one position at a time. The
/// dead-reckoning error grows with distance (at a constant, unknown rate), and a match to the map
/// is fused at each position.
class PathUncertaintyWalk {
 public:
  /// Ends any walk before. Allocates if the path is longer than any before.
  /// @param path_m  two positions or more
  /// @param step_m  distance between matches, > 0: the radius of a scan or more, because closer
  ///   matches would use the same cells with the same errors
  void begin(const std::vector<Vec2>& path_m, double step_m, const DeadReckoning& motion);

  /// Afterwards paths of up to `places` positions allocate nothing.
  void reserve(std::size_t places) { path_m_.reserve(places); }

  /// The end of the path is reached, or none was begun.
  [[nodiscard]] bool over() const { return leg_ + 1 >= path_m_.size(); }
  /// Position of the next match; for a walk that is not over.
  [[nodiscard]] const Vec2& place() const { return place_m_; }
  /// Fuses the match at place() and advances to the next.
  /// @param information  about east and north there [1/m^2], may be singular or zero
  [[nodiscard]] PathUncertainty step(const Eigen::Matrix2d& information);

 private:
  void find_place();

  std::vector<Vec2> path_m_;
  double step_m_ = 0.0;
  std::size_t leg_ = 0;     // from path_m_[leg_] to the next
  double leg_way_m_ = 0.0;  // distance at its beginning
  double way_m_ = 0.0;      // distance of the next position
  Vec2 place_m_ = Vec2::Zero();
  Eigen::Matrix4d dead_ =
      Eigen::Matrix4d::Zero();  // of the position error and its growth per metre
  Eigen::Matrix4d with_map_ = Eigen::Matrix4d::Zero();
};

/// A whole walk, with a match each `radius_m`. The systematic error of the survey is not included.
/// @param path_m  positions in the map's frame, two or more
[[nodiscard]] std::vector<PathUncertainty> path_uncertainty_along(
    const ElevationMap& map, const std::vector<Vec2>& path_m, const DeadReckoning& motion,
    const LocalizabilityParams& params);

}  // namespace rcs
