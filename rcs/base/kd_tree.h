#pragma once
// Exact closest points (paper, section 4: O(N_D log N_M)).

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <nanoflann.hpp>
#include <vector>

#include "rcs/base/points.h"

namespace rcs {

/// A kd-tree over points that must not move or change while the tree exists.
class KdTree {
 public:
  struct Closest {
    std::uint32_t index = 0;
    float distance2_m2 = 0.0F;  ///< squared
  };
  struct Neighbours {
    std::vector<std::uint32_t> index;
    std::vector<float> distance2_m2;
  };

  /// @param points  at least one, all finite
  explicit KdTree(const Points& points)
      : cloud_{points}, tree_(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(kLeaf)) {}

  [[nodiscard]] Closest closest(const Vec3f& p) const { return closest<1>(p); }
  /// The closest point within a distance.
  /// @return false, and `out` unchanged, if there is none
  [[nodiscard]] bool closest_within(const Vec3f& p, float distance_m, Closest* out) const {
    Nearer found{{0, distance_m * distance_m}};
    tree_.findNeighbors(found, p.data(), nanoflann::SearchParams());
    if (!found.any) return false;
    *out = found.closest;
    return true;
  }
  /// The second closest point: for a point of the tree itself, its nearest neighbour.
  [[nodiscard]] Closest closest_other(const Vec3f& p) const { return closest<2>(p); }
  /// The `most` closest points, or all points if there are fewer; the nearest first.
  void nearest(const Vec3f& p, std::size_t most, Neighbours* out) const {
    const std::size_t n = std::min(most, cloud_.points.size());
    out->index.resize(n);
    out->distance2_m2.resize(n);
    nanoflann::KNNResultSet<float, std::uint32_t, std::size_t> found(n);
    found.init(out->index.data(), out->distance2_m2.data());
    tree_.findNeighbors(found, p.data(), nanoflann::SearchParams());
  }

 private:
  static constexpr std::size_t kLeaf = 10;
  // The interface that nanoflann requires of a point set, with its names.
  struct Cloud {
    const Points& points;
    // NOLINTBEGIN(readability-identifier-naming)
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] float kdtree_get_pt(std::uint32_t i, std::size_t axis) const {
      return axis == 0 ? points.x[i] : axis == 1 ? points.y[i] : points.z[i];
    }
    template <class Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
    // NOLINTEND(readability-identifier-naming)
  };
  // A result set for nanoflann, with an initial bound on the distance.
  struct Nearer {
    Closest closest;
    bool any = false;
    // NOLINTBEGIN(readability-identifier-naming)
    [[nodiscard]] bool full() const { return true; }
    [[nodiscard]] float worstDist() const { return closest.distance2_m2; }
    bool addPoint(float distance2_m2, std::uint32_t index) {
      if (distance2_m2 < closest.distance2_m2) {
        closest = {index, distance2_m2};
        any = true;
      }
      return true;
    }
    // NOLINTEND(readability-identifier-naming)
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>,
                                                   Cloud, 3, std::uint32_t>;

  template <std::size_t kWhich>
  [[nodiscard]] Closest closest(const Vec3f& p) const {
    std::array<std::uint32_t, kWhich> index{};
    std::array<float, kWhich> distance2{};
    nanoflann::KNNResultSet<float, std::uint32_t, std::size_t> found(kWhich);
    found.init(index.data(), distance2.data());
    tree_.findNeighbors(found, p.data(), nanoflann::SearchParams());
    return {index[kWhich - 1], distance2[kWhich - 1]};
  }

  Cloud cloud_;
  Tree tree_;
};

}  // namespace rcs
