#pragma once
// Traversal of the pyramid of a tile (world_tile.h) by a ray, in the plane.

#include <algorithm>
#include <cmath>

#include "rcs/base/linear.h"
#include "sim/terrain/world_tile.h"

namespace rcs::sim {

/// A ray with horizontal coordinates in cells from the corner of the world, and heights in metres.
class CellRay {
 public:
  CellRay(double x_cells, double y_cells, const Vec2& cells_per_metre, double z_m, double rise)
      : x_(x_cells, cells_per_metre.x()),
        y_(y_cells, cells_per_metre.y()),
        z_(z_m),
        dz_(rise),
        inverse_dz_(rise < 0.0 ? 1.0 / rise : 0.0) {}

  struct Axis {
    Axis(double at, double per_metre)
        : origin(at),
          direction(per_metre),
          // A ray along the other axis never reaches the faces.
          inverse(1.0 / std::copysign(std::max(std::abs(per_metre), 1e-12), per_metre)),
          forward(std::signbit(per_metre) ? 0 : 1) {}
    double origin;
    double direction;
    double inverse;
    int forward;  ///< 1: towards larger indices
  };
  [[nodiscard]] const Axis& x() const { return x_; }
  [[nodiscard]] const Axis& y() const { return y_; }

  [[nodiscard]] Vec2 place(double range) const {
    return {x_.origin + x_.direction * range, y_.origin + y_.direction * range};
  }
  [[nodiscard]] double rise() const { return dz_; }
  [[nodiscard]] double height_at(double range) const { return z_ + dz_ * range; }
  [[nodiscard]] double lowest(double from, double to) const {
    return z_ + dz_ * (dz_ < 0.0 ? to : from);
  }
  /// Range at which a falling ray reaches a height; 0 for one that does not fall.
  [[nodiscard]] double range_down_to(double height_m) const {
    return (height_m - z_) * inverse_dz_;
  }

 private:
  Axis x_, y_;
  double z_;
  double dz_;
  double inverse_dz_;
};

/// Path of a ray from node to node of one level, within a node `kUp` levels above. Node indices are
/// kept as integers, so that rounding can neither skip a node nor stop the walk.
template <int kLevel, int kUp>
class NodeWalk {
 public:
  /// @param range  at which the ray enters
  /// @param i, j  of the node above, counted from the corner of the world
  NodeWalk(const CellRay& ray, double range, int i, int j)
      : x_(ray.x(), range, i), y_(ray.y(), range, j), range_(range), i_above_(i), j_above_(j) {}

  [[nodiscard]] bool inside() const {
    return ((x_.node >> kUp) == i_above_) & ((y_.node >> kUp) == j_above_);
  }
  [[nodiscard]] double range() const { return range_; }  ///< so far
  [[nodiscard]] double exit() const { return std::max(range_, std::min(x_.exit, y_.exit)); }
  /// Counted from the corner of the world.
  [[nodiscard]] int i() const { return x_.node; }
  [[nodiscard]] int j() const { return y_.node; }
  /// Within the tile.
  [[nodiscard]] int tile_i() const { return x_.node & kInTile; }
  [[nodiscard]] int tile_j() const { return y_.node & kInTile; }

  /// Moves to the next node. Without branches: the order of the faces is unpredictable.
  void advance() {
    range_ = exit();
    const bool x_first = x_.exit < y_.exit;
    x_.step(x_first);
    y_.step(!x_first);
  }

 private:
  static constexpr int kInTile = (Tile::kCells >> kLevel) - 1;

  struct Axis {
    double exit;  // range of the node's far face
    double size;  // range from face to face of a node
    int node;
    int stride;

    Axis(const CellRay::Axis& axis, double range, int above) {
      const int at = static_cast<int>(axis.origin + axis.direction * range) >> kLevel;
      node = std::clamp(at, above << kUp, (above << kUp) + (1 << kUp) - 1);
      constexpr int kWidth = 1 << kLevel;
      exit = ((node + axis.forward) * kWidth - axis.origin) * axis.inverse;
      size = kWidth * std::abs(axis.inverse);
      stride = 2 * axis.forward - 1;
    }
    void step(bool yes) {
      exit += yes ? size : 0.0;
      node += yes ? stride : 0;
    }
  };

  Axis x_, y_;
  double range_;
  int i_above_, j_above_;
};

}  // namespace rcs::sim
