#pragma once
// Points on permanent above-ground structure of a map: trunks, walls, rocks.

#include <cstddef>
#include <memory>
#include <vector>

#include "rcs/base/kd_tree.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"
#include "rcs/base/result.h"

namespace rcs {

struct SurfacePoint {
  /// x and y from the south-western corner of its raster, z as the heights of the raster [m].
  Vec3f p_m = Vec3f::Zero();
  Vec3f normal = Vec3f::UnitX();  ///< unit, towards the sensor; axes of the map's frame
  /// Standard deviation of (surface - plane through the point) around it, without systematic error.
  float sigma_m = 1.0F;
  friend bool operator==(const SurfacePoint& a, const SurfacePoint& b) {
    return a.p_m == b.p_m && a.normal == b.normal && a.sigma_m == b.sigma_m;
  }
};

constexpr std::size_t kMaxSurfacePoints = 8192;    ///< of one tile
constexpr std::size_t kSurfacePointBytes = 28;     ///< of one in a file
constexpr std::size_t kSurfacePointInMemory = 56;  ///< bytes of one, with its share of the kd-tree

/// An error if points cannot belong to a raster of that extent.
[[nodiscard]] Outcome check_surface_points(const std::vector<SurfacePoint>& points, double wide_m,
                                           double high_m);

/// One point for each cube, the first; the edge is the smallest of `voxel_m` * 2^k that leaves at
/// most `most` points. Deterministic.
[[nodiscard]] std::vector<SurfacePoint> thinned(const std::vector<SurfacePoint>& points,
                                                double voxel_m, std::size_t most);

/// A tile's points with their kd-tree, which is built once.
class SurfaceIndex {
 public:
  void load(const std::vector<SurfacePoint>& points);

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  /// The closest point within a distance; null if there is none. Allocates nothing.
  /// @param p_m  as in SurfacePoint
  [[nodiscard]] const SurfacePoint* closest_within(const Vec3f& p_m, float distance_m) const {
    KdTree::Closest found;
    if (tree_ == nullptr || !tree_->tree.closest_within(p_m, distance_m, &found)) return nullptr;
    return &points_[found.index];
  }

 private:
  struct Tree {
    explicit Tree(const std::vector<SurfacePoint>& points);
    Points p_m;
    KdTree tree;  // over p_m, which does not move
  };
  std::vector<SurfacePoint> points_;
  std::unique_ptr<Tree> tree_;  // null: no points
};

}  // namespace rcs
