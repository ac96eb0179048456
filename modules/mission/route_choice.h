#pragma once
// The candidates for the route of a task, and the choice among them.

#include <array>
#include <cstddef>
#include <vector>

#include "modules/mission/route_search.h"
#include "modules/vj/route_value.h"

namespace rcs::mission {

enum class Verdict { kChosen, kDearer, kAboveLimit, kPending };

struct Candidate {
  double poverty_weight = 0.0;
  RouteLine line;  ///< frame of the map
  vj::RouteForecast forecast;
  vj::RouteValue value;
  bool predicted = false;  ///< forecast.sigma_m is known, or is known to be unknown
  Verdict verdict = Verdict::kPending;
};

class RouteChoice {
 public:
  /// Begins the search of routes through these places.
  /// @param places  the vehicle's position, then those of the task, frame of the map
  /// @param speed_mps  by which the time of a route is predicted
  void begin(std::vector<Vec2> places, double speed_mps);
  /// The only candidate is the line through these places.
  void prescribe(const RouteMap& map, std::vector<Vec2> places, double speed_mps);
  void clear() { *this = RouteChoice(); }

  /// Searches one more candidate; candidates that hardly differ count as one.
  /// @return false: there is nothing more to search
  bool search(const RouteMap& map);
  [[nodiscard]] bool searching() const {
    return next_weight_ < kWeights.size() && !places_.empty();
  }

  /// The next candidate whose uncertainty is not predicted yet; null: none.
  [[nodiscard]] const Candidate* unpredicted() const;
  /// For that one; infinite: no prediction was made.
  void predict(double sigma_m);

  /// Values and verdicts of all candidates.
  /// @param gps  received: a route above the limit is then possible, at its cost
  /// @return the chosen one; null: none keeps the limit, or none exists
  const Candidate* choose(const vj::RouteLimits& limits, bool gps);

  [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }

 private:
  static constexpr std::array<double, 4> kWeights = {0.0, 1.0, 4.0, 16.0};

  std::vector<Vec2> places_;
  double speed_mps_ = 1.0;
  std::size_t next_weight_ = 0;
  std::vector<Candidate> candidates_;
  RouteSearch search_;
};

}  // namespace rcs::mission
