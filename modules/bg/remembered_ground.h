#pragma once
// What the vehicle has seen beyond the terrain that WM publishes now, coarsely, and the cost from
// there to the goal. Without it a vehicle before a long wall or in a dead end returns to where it
// has already found no way.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/grid.h"

namespace rcs::bg {

/// A circle to be reached.
struct Goal {
  double x_m = 0.0;
  double y_m = 0.0;
  double radius_m = 2.0;
};

/// Coarse ground in frame local. Allocates nothing after construction.
class RememberedGround {
 public:
  RememberedGround();

  /// Takes over the known ground of a terrain; what leaves the window of 205 m is forgotten. Ground
  /// that the vehicle has driven over is not blocked, whatever the terrain shows later.
  /// @param body_m  radius around the centre of the vehicle that must be free
  void note(const Pose2d& vehicle, const vj::Terrain& terrain, const ObstacleDistance& obstacles,
            const vj::Weights& weights, double body_m);
  /// Another frame local has begun.
  void clear() {
    per_m_.clear();
    driven_.clear();
    last_.reset();
  }

  /// Cost of a metre; 0: never seen; kBlocked: the vehicle cannot stand there.
  [[nodiscard]] const Grid<float>& per_m() const { return per_m_; }

  static constexpr float kBlocked = 1000.0F;  ///< a way around is preferred
  static constexpr int kCells = 256;          ///< of a side of the window
  /// Two cells of the terrain: the vehicle keeps away from an obstacle by more than a metre, so
  /// that even a thin wall is blocked over two cells or more, and no path leads through it
  /// diagonally.
  static constexpr double kCell_m = 0.8;

 private:
  void mark_driven(const Pose2d& vehicle);

  Grid<float> per_m_;
  Grid<std::uint8_t> driven_;
  std::optional<Pose2d> last_;  // of the vehicle
};

/// Cost to a goal over the remembered ground. Allocates nothing after construction.
class FarCost {
 public:
  FarCost();

  /// Fast marching (Sethian 1996): ground that was never seen costs kUnseen a metre, ground where
  /// the vehicle cannot stand so much that every way around it is preferred.
  /// @param forbidden  cells of the window, row by row, where the vehicle must not stand whatever
  ///   the ground is; null: none
  void compute(const RememberedGround& ground, const Goal& goal,
               const std::vector<std::uint8_t>* forbidden = nullptr);

  /// Of the last compute(), in metres of easy ground; outside the window, and before the first
  /// compute(), kUnseen times the straight distance.
  [[nodiscard]] double at(double x_m, double y_m) const;
  /// A way to the goal of the last compute() is known, or may exist over ground that was never
  /// seen.
  [[nodiscard]] bool reachable_from(double x_m, double y_m) const;

  /// Cost of a metre that was never seen: a path is seldom straight or easy.
  static constexpr double kUnseen = 1.5;

 private:
  struct Entry {
    std::int32_t cell;
    std::int32_t next;  // in its bucket; kNone: the last one
  };
  enum class Way : std::uint8_t {
    kOpen,     ///< not computed yet
    kFree,     ///< the cheapest way to the goal
    kBlocked,  ///< where it leads through a cell in which the vehicle cannot stand
    kOutside,  ///< the cells around the window, which save the test for its border
  };
  [[nodiscard]] std::size_t index_of(Cell c) const;
  /// None outside the window, and before the first compute().
  [[nodiscard]] std::optional<std::size_t> cell_at(double x_m, double y_m) const;
  void begin(const Grid<float>& per_m, const std::vector<std::uint8_t>* forbidden);
  void offer(std::size_t cell, float cost);
  void march();
  void accept(std::size_t cell);
  /// Upwind solution of |grad cost| = cost per metre at this cell.
  [[nodiscard]] float solve(std::size_t cell) const;

  Goal goal_;
  bool computed_ = false;
  Cell origin_;  // of the window when the cost was computed
  // Of the window and the cells around it, row by row.
  std::vector<float> step_;      // cost of a cell that is crossed
  std::vector<float> offered_;   // lowest cost so far
  std::vector<float> accepted_;  // final cost; kFar: none yet
  std::vector<Way> way_;
  // A circular queue of buckets of cost (Yatziv 2006), each a list of entries.
  std::vector<std::int32_t> buckets_;
  std::vector<Entry> entries_;
  std::size_t waiting_ = 0;  // entries in the queue
};

}  // namespace rcs::bg
