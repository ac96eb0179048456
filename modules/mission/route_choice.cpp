#include "modules/mission/route_choice.h"

#include <algorithm>
#include <utility>

namespace rcs::mission {
namespace {

constexpr double kSame_m = 15.0;  // largest distance between candidates that count as one

}  // namespace

void RouteChoice::begin(std::vector<Vec2> places, double speed_mps) {
  places_ = std::move(places);
  speed_mps_ = speed_mps;
  next_weight_ = 0;
  candidates_.clear();
}

void RouteChoice::prescribe(const RouteMap& map, std::vector<Vec2> places, double speed_mps) {
  begin({}, speed_mps);
  Candidate c;
  c.line = std::move(places);
  c.forecast.length_m = length_m(c.line);
  c.forecast.time_s = driving_time_s(map, c.line, speed_mps);
  candidates_.push_back(std::move(c));
}

bool RouteChoice::search(const RouteMap& map) {
  if (!searching()) return false;
  const double weight = kWeights[next_weight_++];
  Candidate c;
  c.poverty_weight = weight;
  for (std::size_t k = 1; k < places_.size(); ++k) {
    const RouteLine leg = search_.find(map, places_[k - 1], places_[k], weight);
    if (leg.empty()) {
      // No weight opens a way.
      next_weight_ = kWeights.size();
      return false;
    }
    c.line.insert(c.line.end(), leg.begin() + (c.line.empty() ? 0 : 1), leg.end());
  }
  const auto same = [&c](const Candidate& other) {
    return std::max(distance_m(c.line, other.line), distance_m(other.line, c.line)) < kSame_m;
  };
  if (std::none_of(candidates_.begin(), candidates_.end(), same)) {
    c.forecast.length_m = length_m(c.line);
    c.forecast.time_s = driving_time_s(map, c.line, speed_mps_);
    candidates_.push_back(std::move(c));
  }
  return searching();
}

const Candidate* RouteChoice::unpredicted() const {
  const auto c = std::find_if(candidates_.begin(), candidates_.end(),
                              [](const Candidate& other) { return !other.predicted; });
  return c == candidates_.end() ? nullptr : &*c;
}

void RouteChoice::predict(double sigma_m) {
  const auto c = std::find_if(candidates_.begin(), candidates_.end(),
                              [](const Candidate& other) { return !other.predicted; });
  if (c == candidates_.end()) return;
  c->forecast.sigma_m = sigma_m;
  c->predicted = true;
}

const Candidate* RouteChoice::choose(const vj::RouteLimits& limits, bool gps) {
  Candidate* best = nullptr;
  for (Candidate& c : candidates_) {
    c.value = value_of(c.forecast, limits);
    c.verdict = c.value.keeps_limit ? Verdict::kDearer : Verdict::kAboveLimit;
    const bool possible = gps || c.value.keeps_limit;
    if (possible && (best == nullptr || c.value.cost_s < best->value.cost_s)) best = &c;
  }
  if (best != nullptr) best->verdict = Verdict::kChosen;
  return best;
}

}  // namespace rcs::mission
