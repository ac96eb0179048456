#pragma once
// The search for a way that the vehicle can drive: hybrid A* (Dolgov, Thrun, Montemerlo & Diebel
// 2010) over arcs whose curvature changes by steps, ahead, and backwards over known ground.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "modules/bg/cost_field.h"
#include "modules/bg/obstacle_distance.h"
#include "modules/bg/path.h"

namespace rcs::bg {

struct SearchParams {
  double horizon_m = 30.0;    ///< way to the search's end
  double arc_m = 1.2;         ///< of one expansion
  double bin_m = 0.6;         ///< places nearer than this count as one
  int headings = 32;          ///< bins of a turn
  int max_expansions = 6000;  ///< the grant: each is at most 8 arcs
};

enum class SearchStop {
  kGoal,     ///< the way ends in the goal
  kHorizon,  ///< the way goes on beyond its end
  kBudget,   ///< the best way found within the grant
  kNoWay,    ///< there is none, or the goal lies in what must not be driven
};

struct SearchResult {
  SearchStop stop = SearchStop::kNoWay;
  double cost = 0.0;  ///< of the way and what is left behind it [m of easy ground]
  int expansions = 0;
};

/// Where a search begins.
struct Start {
  Place place;
  int direction = 0;    ///< that the vehicle drives in: 1, -1; 0: it stands, and may do either
  double stop_m = 0.0;  ///< way that it needs to stop: no way turns back before that
};

/// Allocates nothing once it has seen a search as large.
class PathSearch {
 public:
  /// How near to obstacles a way may come that begins so near to one: an obstacle abeam is nearer
  /// or farther by the rounding of cells. When it is very near there is hardly any such slack, or
  /// the vehicle would creep nearer with every new way. What it stands on already is none, or hit:
  /// it may leave.
  [[nodiscard]] static double required_m(double margin_m, double clearance_m) {
    constexpr double kSlack_m = 0.15;
    constexpr double kHardly_m = 0.03;
    constexpr double kVeryNear_m = -0.1;
    constexpr double kOnIt_m = -0.35;
    const double slack_m = clearance_m - kSlack_m;
    if (clearance_m < kOnIt_m) return slack_m;
    return std::min(margin_m, std::max(slack_m, std::min(clearance_m - kHardly_m, kVeryNear_m)));
  }

  PathSearch(const SearchParams& params, const Shape& shape, const vj::Weights& weights);

  /// From now on ways keep so far off obstacles; Shape::margin_m until then.
  void keep_off(double margin_m) { margin_m_ = margin_m; }

  /// @param start  where the vehicle is. Where it stands nearer to an obstacle than the margin
  ///               allows, the way may start so, too, but must not come clearly nearer still.
  /// @param granted  expansions; params.max_expansions is the most that there is room for
  /// @param path  every 0.4 m or less, from `start`; empty when there is no way
  SearchResult search(const vj::Terrain& terrain, const ObstacleDistance& obstacles,
                      const CostField& field, const Start& start, const Goal& goal, int granted,
                      Path* path);

  /// No way begins like this one until release(): what follows it could not take it.
  void bar(const Path& path);
  void release() { barred_.fill(false); }

  /// What the rest of a way costs by the terrain of now, like SearchResult::cost; infinite: it
  /// comes nearer to an obstacle than the margin allows.
  [[nodiscard]] double cost_of_rest(const Path& path, std::size_t from, const vj::Terrain& terrain,
                                    const ObstacleDistance& obstacles,
                                    const CostField& field) const;

  /// From the vehicle's body to the nearest obstacle when it stands there; <= 0: they touch.
  [[nodiscard]] double clearance(const ObstacleDistance& obstacles, const Place& place) const;

  /// What the way is allowed that begins there; and, for the CostField, the body that keeps it.
  [[nodiscard]] double required_m(const ObstacleDistance& obstacles, const Place& start) const {
    return required_m(margin_m_, clearance(obstacles, start));
  }
  [[nodiscard]] double body_m() const { return disc_m_; }

 private:
  struct Node {
    Place place;
    double g;
    double s_m;
    int parent;
    std::int8_t curvature;  // index
    std::int8_t direction;
  };
  struct Open {
    double f;
    int node;
  };
  [[nodiscard]] std::size_t state(const Node& node) const;
  /// The ground under the rear edge of the vehicle when it stands there is known.
  [[nodiscard]] bool known_behind(const vj::Terrain& terrain, const Place& place) const;
  void expand(int index, const vj::Terrain& terrain, const ObstacleDistance& obstacles,
              const CostField& field);
  void offer(const Node& node, double rest);
  void trace(int index, const ObstacleDistance& obstacles, Path* path);

  SearchParams params_;
  Shape shape_;
  vj::Weights weights_;
  double margin_m_;
  double disc_m_;     // radius of the three discs that cover the outline
  double spacing_m_;  // between their middles
  Place origin_;      // of the bins
  int bins_ = 0;      // along each side
  double stop_m_ = 0.0;
  double required_m_ = 0.0;
  std::array<bool, 10> barred_{};  // first arcs, by curvature and direction
  bool trapped_ = false;           // the start lies in what the cells forbid
  std::uint32_t generation_ = 0;
  std::vector<std::uint32_t> seen_;  // generation in which the state was reached
  std::vector<float> best_g_;
  std::vector<Node> nodes_;
  std::vector<Open> open_;
  std::vector<int> chain_;
};

}  // namespace rcs::bg
