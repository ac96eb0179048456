#pragma once
// Paths to goals over the terrain that WM publishes now and the ground that was seen before.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "modules/bg/cost_field.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"
#include "modules/bg/path_search.h"
#include "modules/bg/remembered_ground.h"
#include "rcs/base/stamp.h"

namespace rcs::bg {

/// Allocates nothing after plans as large.
class Planner {
 public:
  /// All in frame local.
  struct Query {
    const vj::Terrain& terrain;
    const ObstacleDistance& obstacles;  ///< of the terrain
    Start start;
    Goal to;
    std::optional<Goal> onward;  ///< the goal after it, if the vehicle need not stop between them
    /// Cells of the remembered ground, see FarCost::compute(); called when a cost is computed.
    std::function<const std::vector<std::uint8_t>*()> forbidden = [] { return nullptr; };
  };

  /// @param near_goal_m  a goal that is occupied, or seems so, is reached at this distance more
  Planner(const SearchParams& params, const Shape& shape, const vj::Weights& weights,
          double near_goal_m);

  /// Remembers the ground of a terrain.
  void note(const Pose2d& vehicle, const vj::Terrain& terrain, const ObstacleDistance& obstacles) {
    remembered_.note(vehicle, terrain, obstacles, weights_,
                     search_.body().radius_m() + shape_.min_margin_m);
  }
  [[nodiscard]] const RememberedGround& remembered() const { return remembered_; }
  /// Another frame local has begun.
  void forget() { remembered_.clear(); }
  /// A task begins: the time for which its goal has been enclosed counts from now on.
  void begin_task() {
    to_.goal.reset();
    onward_.goal.reset();
  }

  /// @param granted  expansions for all searches
  /// @param path  empty if there is none
  SearchResult plan(const Query& query, Stamp now, int granted, Path* path);

  /// Cost of the rest of a path, as SearchResult::cost of the last plan; infinite if it comes
  /// nearer to an obstacle than allowed.
  [[nodiscard]] double cost_of_rest(const Query& query, const Path& path, std::size_t from) const;

  /// Since when no way to the goal is known or can exist and the vehicle has come no nearer to it;
  /// Stamp::max(): it may exist.
  [[nodiscard]] Stamp enclosed_since() const { return enclosed_since_; }

  [[nodiscard]] const Body& body() const { return search_.body(); }
  /// See PathSearch.
  void bar(const Path& path) { search_.bar(path); }
  void release() { search_.release(); }

 private:
  /// A cost over the remembered ground, computed again once a second.
  struct Beyond {
    FarCost cost;
    std::optional<Goal> goal;
    Stamp computed = Stamp::min();
    [[nodiscard]] bool is_of(const Goal& other) const;
    [[nodiscard]] bool is_due(const Goal& other, Stamp now) const;
  };
  void update_cost(const Query& query, Stamp now);
  void update_onward_cost(const Query& query, Stamp now);
  [[nodiscard]] std::optional<Target> onward_target() const;

  Shape shape_;
  vj::Weights weights_;
  double near_goal_m_;
  RememberedGround remembered_;
  Beyond to_;
  Beyond onward_;
  double more_m_ = 0.0;   // increase of the radius of the goal
  bool through_ = false;  // a way from the goal to the one after it may exist
  Stamp enclosed_since_ = Stamp::max();
  double nearest_m_ = 0.0;  // least distance to the goal while it has been enclosed
  CostField field_;
  CostField onward_field_;
  PathSearch search_;
};

}  // namespace rcs::bg
