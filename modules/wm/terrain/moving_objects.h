#pragma once
// What moves among the things that stand upright: clusters of cells, followed from scan to scan by
// the nearest one.

#include <array>
#include <cstddef>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/base/linear.h"

namespace rcs::wm {

struct MovingObject {
  Vec2 p = Vec2::Zero();  ///< centre of what is seen of it, frame local
  Vec2 v = Vec2::Zero();
  double along_m = 0.0;   ///< half of what is seen of it, in the direction of its motion
  double across_m = 0.0;  ///< the same to its sides
  double seen_s = 0.0;
  int scans = 0;
  int missed = 0;  ///< scans in a row whose rays passed where it should be
  bool moves = false;

  // Where it was some time ago.
  static constexpr std::size_t kCells = 64;
  double before_s = 0.0;
  std::size_t before_n = 0;
  std::array<Cell, kCells> before{};

  /// Distance of a place from the ground that the object covers from a time on, for some time, at
  /// the velocity that it has; not positive: on it.
  [[nodiscard]] double distance(const Vec2& place, double from_s, double for_s) const;
};

/// Allocates nothing after construction.
class MovingObjects {
 public:
  MovingObjects(double cell_m, std::size_t max_cells);

  /// @param cells  in which something stands upright in this scan
  /// @param stands  (Cell) -> bool, whether something stands there still, as far as is known
  /// @param free  (Vec2) -> bool, whether rays of this scan pass there
  template <typename Stands, typename Free>
  void observe(const std::vector<Cell>& cells, double time_s, Stands&& stands, Free&& free) {
    cluster(cells);
    follow(time_s);
    for (MovingObject& o : objects_) {
      const bool missed = o.seen_s < time_s && free(Vec2(o.p + (time_s - o.seen_s) * o.v));
      o.missed = missed ? o.missed + 1 : 0;
    }
    for (MovingObject& o : objects_) {
      if (o.seen_s < time_s || time_s - o.before_s < kAgo_s) continue;
      std::size_t gone = 0;
      for (std::size_t k = 0; k < o.before_n; ++k) gone += stands(o.before[k]) ? 0 : 1;
      judge(gone, time_s, &o);
    }
  }

  void clear() { objects_.clear(); }

  /// Those that were seen lately, or that moved out of view. Those that move have `moves`.
  [[nodiscard]] const std::vector<MovingObject>& objects() const { return objects_; }

 private:
  static constexpr double kAgo_s = 0.65;
  struct Cluster {
    std::size_t begin, end;  // in order_
    Vec2 centre;
    bool used;
  };
  [[nodiscard]] Vec2 centre_of(Cell c) const { return cell_m_ * Vec2(c.i + 0.5, c.j + 0.5); }
  void cluster(const std::vector<Cell>& cells);
  void follow(double time_s);
  void update(const Cluster& cluster, double time_s, MovingObject* object) const;
  void judge(std::size_t gone, double time_s, MovingObject* object) const;
  void remember(const Cluster& cluster, double time_s, MovingObject* object) const;

  double cell_m_;
  std::vector<Cell> order_;  // cluster by cluster
  std::vector<Cluster> clusters_;
  std::vector<MovingObject> objects_;
};

}  // namespace rcs::wm
