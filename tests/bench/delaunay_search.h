#pragma once
// Closest points as Madhavan and Messina search for them (section 2.1, step 1): over a Delaunay
// triangulation of the model. For comparison only; the vehicle uses rcs/base/kd_tree.h.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/base/kd_tree.h"
#include "rcs/base/points.h"

namespace rcs::bench {

/// Walks from vertex to nearer neighbour. A vertex without one is the nearest of all: Voronoi cells
/// are bounded by the bisectors to Delaunay neighbours alone.
class DelaunaySearch {
 public:
  using Closest = KdTree::Closest;
  /// Start vertex and cost of a walk: a query near the last one is cheap.
  struct Walk {
    std::uint32_t vertex = 0;
    std::uint64_t steps = 0;      ///< in all
    std::uint64_t distances = 0;  ///< computed, in all
  };

  /// @param points  at least one, all finite. Of coincident points the first is found.
  explicit DelaunaySearch(const Points& points);

  [[nodiscard]] Closest closest(const Vec3f& p, Walk* walk) const;

  [[nodiscard]] std::size_t vertices() const { return at_.size(); }
  [[nodiscard]] std::size_t simplices() const { return simplices_; }
  /// Mean number of neighbours of a vertex.
  [[nodiscard]] double degree() const {
    return static_cast<double>(neighbours_.size()) / static_cast<double>(at_.size());
  }
  /// Distinct points that the triangulation treats as coplanar with a simplex: they can be reached
  /// from its corners only.
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

 private:
  /// Vertices that are neighbours of each other: usually the four of a simplex.
  struct Simplex {
    std::array<std::uint32_t, 6> corners{};
    std::size_t size = 0;

    void add(std::uint32_t vertex) { corners.at(size++) = vertex; }
  };

  bool triangulate(const char* options, std::vector<Simplex>* simplices);
  void connect(const std::vector<Simplex>& simplices);

  // By vertex: one for each distinct position.
  std::vector<Vec3f> at_;
  std::vector<std::uint32_t> index_;  // of the point
  std::vector<std::uint32_t> first_;  // of its neighbours; one more at the end
  std::vector<std::uint32_t> neighbours_;
  std::size_t simplices_ = 0;
  std::size_t left_out_ = 0;
};

}  // namespace rcs::bench
