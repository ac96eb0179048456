#pragma once
// The search for a drivable path: hybrid A* (Dolgov, Thrun, Montemerlo & Diebel 2010) over arcs
// whose curvature changes by steps, ahead, and backwards over known ground.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "modules/bg/body.h"
#include "modules/bg/cost_field.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"

namespace rcs::bg {

struct SearchParams {
  double horizon_m = 30.0;    ///< length of path to the end of the search
  double arc_m = 1.2;         ///< length of one expansion
  double bin_m = 0.6;         ///< positions closer than this are equivalent
  int headings = 32;          ///< bins of the heading in a full turn
  int max_expansions = 6000;  ///< largest grant; an expansion has at most 12 arcs
};

enum class SearchStop {
  kGoal,     ///< the path ends in the goal
  kHorizon,  ///< the path continues beyond the horizon
  kBudget,   ///< the best path found within the grant
  kNoWay,    ///< no path, or the goal is impassable
};

struct SearchResult {
  SearchStop stop = SearchStop::kNoWay;
  double cost = 0.0;  ///< of the path and of the rest to the goal [m of easy ground]
  int expansions = 0;
};

/// Start of a search.
struct Start {
  Pose2d place;
  int direction =
      0;  ///< current direction of motion: 1, -1; 0: at rest, either direction is allowed
  double stop_m = 0.0;       ///< stopping distance: no path reverses before that
  double required_m = 0.25;  ///< distance from obstacles, see RequiredClearance
};

/// A goal and the cost of the way to it.
struct Target {
  Goal goal;
  const CostField* field;
};

/// Allocates nothing after a search as large.
class PathSearch {
 public:
  PathSearch(const SearchParams& params, const Shape& shape, const vj::Weights& weights);

  /// @param to  the path leads through it
  /// @param onward  and from there on towards this one, so that the vehicle need not stop between
  ///   them; none: it ends in `to`
  /// @param granted  expansions; at most params.max_expansions
  /// @param path  points every 0.4 m or less, from `start`; empty if there is no path
  SearchResult search(const vj::Terrain& terrain, const ObstacleDistance& obstacles,
                      const Start& start, const Target& to, const std::optional<Target>& onward,
                      int granted, Path* path);

  /// Excludes paths that begin like this one until release(): the vehicle could not follow it.
  void bar(const Path& path);
  void release() { barred_.fill(false); }

  /// Cost of the rest of a path on the current terrain, like SearchResult::cost; infinite if it
  /// comes closer to an obstacle than the margin allows.
  [[nodiscard]] double cost_of_rest(const Path& path, std::size_t from, const vj::Terrain& terrain,
                                    const ObstacleDistance& obstacles, const Target& to,
                                    const std::optional<Target>& onward) const;

  [[nodiscard]] const Body& body() const { return body_; }

 private:
  struct Node {
    Pose2d place;
    double g;
    double s_m;
    int parent;
    std::int8_t curvature;  // index
    std::int8_t direction;
    std::uint8_t leg;  // 0: to the first target, 1: onward from it
  };
  struct Open {
    double f;
    int node;
  };
  [[nodiscard]] std::size_t state(const Node& node) const;
  /// Whether the ground `margin_m` behind the rear edge of the vehicle at this pose is known.
  [[nodiscard]] bool known_behind(const vj::Terrain& terrain, const Pose2d& place,
                                  double margin_m) const;
  /// Roll of the vehicle on the ground there, without its sign [rad].
  [[nodiscard]] static double roll(const vj::Terrain& terrain, const Pose2d& place);
  /// Of the ground below and, backwards, of what is unseen behind, in metres of easy ground.
  [[nodiscard]] double cost_per_m(const vj::Terrain& terrain, const Pose2d& place, int direction,
                                  double clearance_m) const;
  /// @param reached  the first target, by this node
  void expand(int index, const vj::Terrain& terrain, const ObstacleDistance& obstacles,
              bool reached);
  /// Cost of the way from there to the last target.
  [[nodiscard]] double remaining(const Pose2d& place, int leg) const;
  void offer(const Node& node);
  void trace(int index, const ObstacleDistance& obstacles, Path* path);

  SearchParams params_;
  Shape shape_;
  vj::Weights weights_;
  Body body_;
  Pose2d origin_;                    // of the bins
  int bins_ = 0;                     // along each side
  std::array<Target, 2> targets_{};  // the last one twice if there is no onward
  double onward_cost_ = 0.0;         // from the first target to the last
  double stop_m_ = 0.0;
  double required_m_ = 0.0;
  double max_roll_rad_ = 0.0;
  std::array<bool, 18> barred_{};  // first arcs, by curvature and direction
  bool trapped_ = false;           // the start lies in a blocked cell
  std::uint32_t generation_ = 0;
  std::vector<std::uint32_t> seen_;  // generation in which the state was reached
  std::vector<float> best_g_;
  std::vector<Node> nodes_;
  std::vector<Open> open_;
  std::vector<int> chain_;
};

}  // namespace rcs::bg
