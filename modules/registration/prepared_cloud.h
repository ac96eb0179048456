#pragma once
// A point cloud prepared for registration with another one.

#include <vector>

#include "modules/registration/range_view.h"
#include "modules/registration/rolling_map.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

struct PreparedCloudParams {
  PreparedCloudParams();
  RollingMapParams map;
  /// Of a cloud with more points every third is used: more cost time and hardly change the result.
  int dense_points = 60'000;
  int points = 6000;          ///< that are examined, approximately
  int test_points = 250;      ///< structure points by which a pose is judged, at most 255
  double test_voxel_m = 0.5;  ///< one of each voxel
};

/// Most surfaces of an outdoor scan belong to the ground, which determines height, roll and pitch
/// and looks the same everywhere. What is not ground (walls, poles, vehicles, trees) determines the
/// other directions: the structure. The ground is found as the surfaces with the most frequent
/// normal within 40 deg of the z axis; of several the one nearest to it. A scan of walls alone has
/// none.
class PreparedCloud {
 public:
  /// @param points  [m], finite, at least one; from one position, which is the origin
  PreparedCloud(const Points& points, const PreparedCloudParams& params);

  /// Surfaces; non-const because they are fitted at their first use.
  [[nodiscard]] RollingMap* map() { return &map_; }
  /// Unit vector: normal of the ground, with z >= 0.77; without ground the z axis.
  [[nodiscard]] const Vec3f& up() const { return up_; }
  [[nodiscard]] bool has_ground() const { return !ground_.empty(); }
  /// up' p of the ground that is nearest to the line along up() through `p` [m].
  [[nodiscard]] float ground_m(const Vec3f& p) const;
  /// Points that are not on a surface across up(); all points, if these are too few.
  [[nodiscard]] const Points& structure() const { return structure_; }
  /// Of the structure, thinned, and other points if it has too few.
  [[nodiscard]] const Points& test_points() const { return test_points_; }
  /// Of the test points, with sum 1: the rarer the direction of their normal, the greater.
  [[nodiscard]] const std::vector<float>& weights() const { return weights_; }
  [[nodiscard]] const RangeView& view() const { return view_; }

 private:
  PreparedCloud(const PreparedCloudParams& params, const Points& used);

  RollingMap map_;
  RangeView view_;
  Vec3f up_ = Vec3f::UnitZ();
  Points ground_;
  Points structure_;
  Points test_points_;
  std::vector<float> weights_;
};

/// How well two clouds explain each other at a pose. Points of unknown regions do not count: with
/// little overlap the right pose explains little, but it contradicts next to nothing.
struct Plausibility {
  double explained = 0.0;  ///< share of the test points on a surface of the other cloud, both ways
  double contradicted = 0.0;  ///< share of them in free space of the other scan
  [[nodiscard]] double score() const { return explained - contradicted; }  ///< [-1, 1]
};
[[nodiscard]] Plausibility plausibility(PreparedCloud* model, PreparedCloud* data,
                                        const Pose& T_model_data, double tolerance_m);

/// The guess, if both have a ground turned so that the normals of the grounds coincide, and lifted
/// so that the data's sensor is as high above the model's ground as above its own.
[[nodiscard]] Pose on_common_ground(const PreparedCloud& model, const PreparedCloud& data,
                                    const Pose& guess);

}  // namespace rcs::registration
