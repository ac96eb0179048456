#include "modules/wm/path_uncertainty_node.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/plausible.h"
#include "modules/wm/fault_detection/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr std::size_t kMaxPlaces = 1000;  // of a path; of an answer with its begin
constexpr std::size_t kMaxIssuer = 64;    // characters
constexpr std::size_t kBytesAPlace = 5 * sizeof(float);

}  // namespace

PathUncertaintyServer::PathUncertaintyServer(const PathUncertaintyParams& params,
                                             PriorTerrain prior, Bus* bus)
    : params_(params),
      prior_(std::move(prior)),
      queries_(bus, channel::kWmPathQuery, 2),
      answers_(bus, channel::kWmPathUncertainty) {
  path_m_.reserve(kMaxPlaces + 1);
  walk_.reserve(kMaxPlaces + 1);
  answers_.reserve(kBytesAPlace * kMaxPlaces + 500);
  for (auto* figures : {&answer_.travelled_m, &answer_.x_m, &answer_.y_m,
                        &answer_.sigma_dead_reckoning_m, &answer_.sigma_with_map_m}) {
    figures->reserve(kMaxPlaces + 2);
  }
}

void PathUncertaintyServer::step(const FilterState* state, const LocalFrame* datum, Stamp now,
                                 Report* report) {
  for (; !queries_.empty(); queries_.pop()) accept(*queries_.front(), state, datum, now, report);
  if (walking_) walk(now, report);
}

void PathUncertaintyServer::accept(const path_query_t& query, const FilterState* state,
                                   const LocalFrame* datum, Stamp now, Report* report) {
  if (query.issuer.size() > kMaxIssuer) {
    report->publish(now, event::kWmPathIssuer, "path query rejected: issuer of {} characters > {}",
                    query.issuer.size(), kMaxIssuer);
    return;
  }
  const bool same_issuer = asked_ && query.issuer == answer_.issuer;
  const bool again = same_issuer && query.serial == answer_.serial;
  if (again && !walking_) answers_.publish(&answer_);  // the first may have been lost
  // Other issuers repeat their query until it is handled: otherwise no query would be completed.
  const bool waits = walking_ && !(same_issuer && query.serial > answer_.serial);
  if (!again && !waits) begin(query, state, datum);
}

void PathUncertaintyServer::begin(const path_query_t& query, const FilterState* state,
                                  const LocalFrame* datum) {
  asked_ = true;
  walking_ = false;
  answer_.issuer = query.issuer;
  answer_.serial = query.serial;
  answer_.utime = query.utime;
  // Along the path nothing will be matched to a map that is excluded.
  const bool excluded = state != nullptr && (state->bookkeeping.excluded.prior_map ||
                                             state->bookkeeping.excluded.ladar);
  uses_map_ = prior_.there() && !excluded;
  answer_.has_map = uses_map_ ? 1 : 0;
  answer_.map_bias_sigma_m = uses_map_ ? prior_.map().level(0).bias_sigma_m : 0.0;
  answer_.n = 0;
  for (auto* figures : {&answer_.travelled_m, &answer_.x_m, &answer_.y_m,
                        &answer_.sigma_dead_reckoning_m, &answer_.sigma_with_map_m}) {
    figures->clear();
  }
  if (state == nullptr || datum == nullptr) return answer(path_uncertainty_t::STATE_NO_WORLD);
  const NavState& x = state->belief.x;
  const Cov& P = state->belief.P;
  if (!read_path(query, x.T_world_vehicle.p.head<2>())) {
    return answer(path_uncertainty_t::STATE_BAD_PATH);
  }
  answer_.utime = to_utime(x.stamp);
  prior_.set_datum(datum->datum());
  double length_m = 0.0;
  for (std::size_t k = 1; k < path_m_.size(); ++k) {
    length_m += (path_m_[k] - path_m_[k - 1]).norm();
  }
  DeadReckoning motion;
  motion.start_sigma_m = std::sqrt(largest_variance(P.block<2, 2>(kPosition, kPosition)));
  // A heading error causes a position error that is a constant share of the distance.
  motion.drift = std::hypot(params_.drift, std::sqrt(P(kAttitude + 2, kAttitude + 2)));
  walk_.begin(path_m_, std::max(params_.radius_m, length_m / static_cast<double>(kMaxPlaces)),
              motion);
  walking_ = true;
}

bool PathUncertaintyServer::read_path(const path_query_t& query, const Vec2& start) {
  path_m_.assign(1, start);
  const auto n = static_cast<std::size_t>(query.n);
  if (n == 0 || n > kMaxPlaces) return false;
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3 p(query.x_m[k], query.y_m[k], 0.0);
    if (!within(p, kFarthest_m)) return false;
    path_m_.emplace_back(p.head<2>());
  }
  return true;
}

void PathUncertaintyServer::walk(Stamp now, Report* report) {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  if (uses_map_ && prior_.T_map_world()) {
    // Both planes are level, each at its own datum: they differ in the direction of north.
    const Pose& T_map_world = *prior_.T_map_world();
    const Vec2 place = (T_map_world * Vec3(walk_.place().x(), walk_.place().y(), 0.0)).head<2>();
    prior_.follow_in_map(place, now, report);
    if (!prior_.map().complete()) return;
    LocalizabilityParams seen;
    seen.radius_m = params_.radius_m;
    const Eigen::Matrix2d R_map_world = T_map_world.q.toRotationMatrix().topLeftCorner<2, 2>();
    information =
        R_map_world.transpose() * terrain_information(prior_.map(), place, seen) * R_map_world;
  }
  const PathUncertainty here = walk_.step(information);
  answer_.travelled_m.push_back(static_cast<float>(here.travelled_m));
  answer_.x_m.push_back(static_cast<float>(here.place_m.x()));
  answer_.y_m.push_back(static_cast<float>(here.place_m.y()));
  answer_.sigma_dead_reckoning_m.push_back(static_cast<float>(here.sigma_dead_reckoning_m));
  answer_.sigma_with_map_m.push_back(static_cast<float>(here.sigma_with_map_m));
  ++answer_.n;
  if (walk_.over()) answer(path_uncertainty_t::STATE_ANSWERED);
}

void PathUncertaintyServer::answer(std::int8_t state) {
  walking_ = false;
  answer_.state = state;
  answers_.publish(&answer_);
}

}  // namespace rcs::wm
