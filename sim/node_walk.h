#pragma once
// A ray's way through the pyramid of a tile (see tile.h), seen from above.

#include <algorithm>
#include <cmath>

#include "rcs/base/linear.h"
#include "sim/tile.h"

namespace rcs::sim {

/// A ray in cells from the world's corner across, and metres up.
struct CellRay {
  CellRay(const Vec2& origin_cells, const Vec2& cells_per_metre, double z_m, double rise)
      : origin(origin_cells),
        direction(cells_per_metre),
        z(z_m),
        dz(rise),
        inverse_dz(rise < 0.0 ? 1.0 / rise : 0.0) {}

  [[nodiscard]] double height_at(double range) const { return z + dz * range; }
  [[nodiscard]] double lowest(double from, double to) const {
    return z + dz * (dz < 0 ? to : from);
  }
  /// Where a falling ray has come down to a height; 0 for one that does not fall.
  [[nodiscard]] double range_down_to(double height_m) const { return (height_m - z) * inverse_dz; }

  Vec2 origin;
  Vec2 direction;
  double z;
  double dz;
  double inverse_dz;
};

/// The node that the ray is in. Node indices are carried along as integers, so that rounding can
/// neither skip a node nor stand still; the ranges of the node's far faces are carried along by
/// sums.
class NodeWalk {
 public:
  /// In the node of `level` where the ray starts.
  NodeWalk(const CellRay& ray, int level)
      : x_(ray.origin.x(), ray.direction.x(), level),
        y_(ray.origin.y(), ray.direction.y(), level),
        level_(level) {}

  [[nodiscard]] int level() const { return level_; }
  [[nodiscard]] double range() const { return range_; }  ///< so far
  [[nodiscard]] double exit() const { return std::max(range_, std::min(x_.exit, y_.exit)); }
  [[nodiscard]] int tile_i() const { return x_.node >> (Tile::kTop - level_); }
  [[nodiscard]] int tile_j() const { return y_.node >> (Tile::kTop - level_); }
  /// The node within its tile.
  [[nodiscard]] int i() const { return x_.node & ((Tile::kCells >> level_) - 1); }
  [[nodiscard]] int j() const { return y_.node & ((Tile::kCells >> level_) - 1); }
  /// Where the ray is in a cell (level 0), in [0, 1]^2.
  [[nodiscard]] Vec2 place_in_cell(const CellRay& ray) const {
    return ray.origin + ray.direction * range_ - Vec2(x_.node, y_.node);
  }

  /// Moves on within the node.
  void skip_to(double range) { range_ = std::max(range_, range); }

  /// To the child where the ray is.
  void descend() {
    --level_;
    x_.descend(range_);
    y_.descend(range_);
  }

  /// To the parent.
  void ascend() {
    ++level_;
    x_.ascend();
    y_.ascend();
  }

  /// To the neighbour on the same level.
  /// @return the bits of the node's index that changed: bit 0 alone if it has the same parent
  int advance() { return x_.exit < y_.exit ? x_.advance(&range_) : y_.advance(&range_); }

 private:
  struct Axis {
    double size;  // range from face to face of a node
    double exit;  // range of the node's far face
    int node;
    int forward;  // 1: towards larger indices

    Axis(double origin, double direction, int level)
        : node(static_cast<int>(origin) >> level), forward(direction >= 0.0 ? 1 : 0) {
      const int cells = 1 << level;
      // A ray along the other axis never reaches the faces.
      const double cell = 1.0 / std::max(std::abs(direction), 1e-12);
      size = cells * cell;
      exit = std::abs((node + forward) * cells - origin) * cell;
    }
    void descend(double range) {
      size *= 0.5;
      const double middle = exit - size;
      if (range < middle) {
        exit = middle;
        node = 2 * node + 1 - forward;
      } else {
        node = 2 * node + forward;
      }
    }
    int advance(double* range) {
      *range = std::max(*range, exit);
      exit += size;
      const int old = node;
      node += 2 * forward - 1;
      return node ^ old;
    }
    void ascend() {
      if ((node & 1) != forward) exit += size;
      size *= 2.0;
      node >>= 1;
    }
  };

  Axis x_, y_;
  int level_;
  double range_ = 0.0;
};

}  // namespace rcs::sim
