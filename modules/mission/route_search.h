#pragma once
// Routes over the a priori map: the cheapest way for a given weight of localizability.

#include <vector>

#include "modules/mission/route_map.h"

namespace rcs::mission {

/// Places along a route, in the frame of the map; straight between them.
using RouteLine = std::vector<Vec2>;

/// A* over the cells with 16 directions, then shortened where a straight line costs no more.
class RouteSearch {
 public:
  /// @param poverty  weight: metres that a metre of ground without features costs in addition
  /// @return empty: there is none. Its ends are the positions given, also where their cells are
  ///   impassable: the vehicle stands at one, and BG decides how near it comes to the other
  [[nodiscard]] RouteLine find(const RouteMap& map, const Vec2& from, const Vec2& to,
                               double poverty);

 private:
  struct Open {
    float estimate;
    int cell;
  };
  [[nodiscard]] RouteLine trace(const RouteMap& map, int from, int to) const;

  std::vector<float> cost_;
  std::vector<int> before_;
  std::vector<Open> open_;
};

[[nodiscard]] double length_m(const RouteLine& line);

/// At this speed, and slower in speed zones.
[[nodiscard]] double driving_time_s(const RouteMap& map, const RouteLine& line, double speed_mps);

/// The largest distance of a place of `a` to `b`: whether two candidates differ.
[[nodiscard]] double distance_m(const RouteLine& a, const RouteLine& b);

}  // namespace rcs::mission
