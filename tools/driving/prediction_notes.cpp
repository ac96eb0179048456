#include "tools/driving/prediction_notes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/local_levels.h"

namespace rcs::driving {
namespace {

constexpr char kMission[] = "mission";
constexpr std::size_t kAnswers = 16;  // more than the candidates of a choice
constexpr double kOnRoute_m = 20.0;   // of the places of a prediction, 25 m apart
constexpr std::int64_t kEach_us = 1'000'000;
constexpr std::int64_t kGpsLost_us = 2'000'000;

double distance_m(const path_uncertainty_t& m, std::size_t k, double x_m, double y_m) {
  return std::hypot(static_cast<double>(m.x_m[k]) - x_m, static_cast<double>(m.y_m[k]) - y_m);
}

/// Of the places of a prediction from a route: the mean.
double off_route_m(const path_uncertainty_t& m, const route_t& route) {
  double sum_m = 0.0;
  for (std::size_t k = 0; k < m.x_m.size(); ++k) {
    const Vec2 p(m.x_m[k], m.y_m[k]);
    double nearest_m = std::numeric_limits<double>::infinity();
    for (std::size_t j = 1; j < route.x_m.size(); ++j) {
      const Vec2 from(route.x_m[j - 1], route.y_m[j - 1]);
      const Vec2 leg = Vec2(route.x_m[j], route.y_m[j]) - from;
      const double t =
          std::clamp((p - from).dot(leg) / std::max(1e-9, leg.squaredNorm()), 0.0, 1.0);
      nearest_m = std::min(nearest_m, (p - from - t * leg).norm());
    }
    sum_m += nearest_m;
  }
  return sum_m / static_cast<double>(std::max<std::size_t>(1, m.x_m.size()));
}

double predicted_m(const path_uncertainty_t& m, std::size_t k) {
  return std::hypot(m.sigma_with_map_m[k], m.map_bias_sigma_m);
}

}  // namespace

PredictionNotes::PredictionNotes(Bus* bus)
    : predictions_(bus, channel::kWmPathUncertainty,
                   [this](const path_uncertainty_t& m, Stamp) { accept(m); }),
      routes_(bus, channel::kMissionRoutes, [this](const routes_t& m, Stamp) { accept(m); }),
      nav_states_(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp) { accept(m); }) {}

void PredictionNotes::accept(const path_uncertainty_t& m) {
  if (m.issuer != kMission || m.state != path_uncertainty_t::STATE_ANSWERED || m.n == 0) return;
  answers_.push_back(m);
  if (answers_.size() > kAnswers) answers_.pop_front();
}

// The prediction whose path is the chosen route; with GPS the uncertainty along it is another.
void PredictionNotes::accept(const routes_t& m) {
  of_route_.reset();
  const auto chosen = std::find_if(m.route.begin(), m.route.end(), [](const route_t& r) {
    return r.verdict == route_t::VERDICT_CHOSEN;
  });
  if (m.gps != 0 || chosen == m.route.end()) return;
  double nearest_m = kOnRoute_m;
  // Of equally near ones the newest.
  for (auto answer = answers_.rbegin(); answer != answers_.rend(); ++answer) {
    const double off_m = off_route_m(*answer, *chosen);
    if (off_m >= nearest_m) continue;
    nearest_m = off_m;
    of_route_ = *answer;
  }
}

void PredictionNotes::accept(const nav_state_t& m) {
  const bool gps = m.age_gps_us >= 0 && m.age_gps_us < kGpsLost_us;
  Pose T_world_vehicle;
  if (!of_route_ || gps || m.world_valid == 0 || m.utime - noted_utime_ < kEach_us ||
      !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle)) {
    return;
  }
  noted_utime_ = m.utime;
  std::size_t nearest = 0;
  const Vec3& p = T_world_vehicle.p;
  for (std::size_t k = 1; k < of_route_->x_m.size(); ++k) {
    const bool nearer =
        distance_m(*of_route_, k, p.x(), p.y()) < distance_m(*of_route_, nearest, p.x(), p.y());
    if (nearer) nearest = k;
  }
  if (distance_m(*of_route_, nearest, p.x(), p.y()) > kOnRoute_m) return;
  const double stated_m = std::sqrt(horizontal_variance(m.cov_world_pose, T_world_vehicle));
  const double expected_m = predicted_m(*of_route_, nearest);
  outcome_.ratios.push_back(stated_m / std::max(1e-3, expected_m));
  outcome_.stated_max_m = std::max(outcome_.stated_max_m, stated_m);
  outcome_.predicted_max_m = std::max(outcome_.predicted_max_m, expected_m);
}

PredictionOutcome PredictionNotes::outcome() const {
  PredictionOutcome out = outcome_;
  std::sort(out.ratios.begin(), out.ratios.end());
  return out;
}

double share_predicted(const std::vector<double>& sorted) {
  if (sorted.empty()) return 1.0;
  const auto first = std::lower_bound(sorted.begin(), sorted.end(), 0.5);
  const auto last = std::upper_bound(sorted.begin(), sorted.end(), 2.0);
  return static_cast<double>(last - first) / static_cast<double>(sorted.size());
}

}  // namespace rcs::driving
