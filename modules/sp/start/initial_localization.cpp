#include "modules/sp/start/initial_localization.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::sp {
namespace {

constexpr float kOut = std::numeric_limits<float>::infinity();
// The pose of a standing vehicle trembles: the distance is counted in steps of this length.
constexpr double kStep_m = 0.5;
// Samples for the first evaluation of a hypothesis, and the mean cost of a sample from which on it
// is dropped: half the square of a residual is bounded by 4.5, and by chance is near 3.
constexpr std::size_t kGlance = 40;
constexpr double kHopeless = 3.2;
// Root mean square distance of the nearest hypothesis in steps of the grid, rotation and shift
// together.
constexpr double kOffGrid = 0.6;
// Decay in each round, from the grid's inflation to zero.
constexpr double kSpreadSinks = 0.6;
constexpr double kSpreadEnds_m = 0.05;
constexpr double kSettled_m = 0.02;
// Required share of the ground with map data at a candidate pose.
constexpr double kMinKnown = 0.8;
// Distance between evaluations of new ground, once enough of it has been driven over.
constexpr double kAgainEvery_m = 5.0;
// Lower bound of the sigma of the result: errors of the survey are correlated over some cells, and
// frame level rotates by as much between the middle of the window and its end.
constexpr double kFloorSigma_m = 0.1;
constexpr double kFloorSigma_rad = 0.007;

double largest_sigma(const Mat6& covariance) {
  const double a = covariance(0, 0), b = covariance(1, 1), c = covariance(0, 1);
  return std::sqrt(0.5 * (a + b) + std::hypot(0.5 * (a - b), c));
}

}  // namespace

InitialLocalizer::InitialLocalizer(const InitialLocalizationParams& params)
    : params_(params), patch_(params.patch) {
  cells_.reserve(patch_.capacity());
  const auto samples = static_cast<std::size_t>(params.samples);
  workspace_.table.reserve(samples);
  workspace_.counts.reserve(samples);
  workspace_.member.reserve(samples);
  workspace_.planes.reserve(samples);
  submap_.samples.reserve(samples);
  again_.samples.reserve(samples);
  residuals_.reserve(samples);
  costs_.reserve(static_cast<std::size_t>(params.hypotheses));
  followed_.reserve(static_cast<std::size_t>(params.refined));
}

bool fits(const StartRegion& region, const InitialLocalizationParams& params) {
  // The ground of the window extends no farther from its middle: this bounds the headings' spacing.
  const double radius_m = 0.5 * params.window_m + params.patch.reach_m;
  const double headings = 2.0 * region.within_rad * radius_m / params.grid_m + 2.0;
  const double side = 2.0 * region.radius_m / params.grid_m + 3.0;
  return headings * side * side <= params.hypotheses;
}

bool InitialLocalizer::begin(const StartRegion& region) {
  stop();
  region_ = region;
  if (!fits(region, params_)) return false;
  status_.state = InitialLocalizationState::kCollecting;
  status_.reason = InitialLocalizationReason::kTooEarly;
  return true;
}

void InitialLocalizer::stop() {
  status_ = {};
  patch_.clear();
  phase_ = Phase::kIdle;
  started_ = false;
  searched_at_m_ = params_.min_travelled_m - params_.every_m;
}

void InitialLocalizer::add(const Points& lowest_vehicle, const Pose& T_level_vehicle) {
  if (status_.state == InitialLocalizationState::kOff ||
      status_.state == InitialLocalizationState::kFound) {
    return;
  }
  if (!started_) {
    started_ = true;
    T_level_start_ = T_level_vehicle;
    last_p_level_ = T_level_vehicle.p;
  }
  const double step_m = (T_level_vehicle.p - last_p_level_).norm();
  if (step_m >= kStep_m) {
    status_.travelled_m += step_m;
    last_p_level_ = T_level_vehicle.p;
  }
  patch_.add(lowest_vehicle, T_level_vehicle, status_.travelled_m);
}

WorkUnits InitialLocalizer::work(const ElevationMap& map, WorkUnits granted) {
  WorkUnits used = 0;
  if (phase_ == Phase::kIdle && status_.state == InitialLocalizationState::kCollecting &&
      status_.travelled_m >= searched_at_m_ + params_.every_m) {
    prepare();
  }
  if (phase_ == Phase::kSweep) sweep(map, granted, &used);
  if (phase_ == Phase::kFollow) follow(map, granted, &used);
  if (phase_ == Phase::kAgain) confirm(map, granted, &used);
  return used;
}

void InitialLocalizer::prepare() {
  searched_at_m_ = status_.travelled_m;
  patch_.gather(0.0, status_.travelled_m - params_.window_m, &cells_);
  make_submap(cells_, static_cast<std::size_t>(params_.samples), params_.fit, &workspace_,
              &submap_);
  if (submap_.samples.size() < static_cast<std::size_t>(params_.rough_samples)) return;
  spread_m_ = std::hypot(kOffGrid * params_.grid_m * submap_.slope,
                         params_.fit.tilt_sigma_rad * submap_.radius_m);
  side_ = 2 * static_cast<int>(std::ceil(region_.radius_m / params_.grid_m)) + 1;
  const double finest = params_.grid_m / std::max(submap_.radius_m, params_.grid_m);
  headings_ = static_cast<int>(std::ceil(2.0 * region_.within_rad / finest)) + 1;
  const std::size_t n = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) *
                        static_cast<std::size_t>(headings_);
  if (n > costs_.capacity()) {
    headings_ = static_cast<int>(costs_.capacity() / static_cast<std::size_t>(side_ * side_));
  }
  costs_.assign(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_) *
                    static_cast<std::size_t>(headings_),
                kOut);
  next_ = 0;
  phase_ = Phase::kSweep;
  status_.state = InitialLocalizationState::kSearching;
}

/// The centre of the submap is the start position in the disc plus the path from there.
GroundPlace InitialLocalizer::on_grid(std::size_t k) const {
  const std::size_t square = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  const std::size_t heading = k / square;
  const std::size_t row = k % square / static_cast<std::size_t>(side_);
  const auto h = static_cast<double>(heading);
  const auto j = static_cast<double>(row);
  const auto i = static_cast<double>(k % static_cast<std::size_t>(side_));
  GroundPlace place;
  const double turn = headings_ > 1 ? 2.0 * h / (headings_ - 1) - 1.0 : 0.0;
  place.yaw_rad =
      wrap_angle(region_.yaw_rad + turn * region_.within_rad - yaw_of(T_level_start_.q));
  const Vec2 off = params_.grid_m * (Vec2(i, j) - Vec2::Constant(0.5 * (side_ - 1)));
  const Eigen::Rotation2Dd R(place.yaw_rad);
  const Vec2 way = (submap_.centre_level - T_level_start_.p).head<2>();
  place.centre_map.head<2>() = region_.middle_m + off + R * way;
  return place;
}

void InitialLocalizer::sweep(const ElevationMap& map, WorkUnits granted, WorkUnits* used) {
  const auto rough = static_cast<std::size_t>(params_.rough_samples);
  const double half = 0.5 * (side_ - 1);
  const double reach = region_.radius_m / params_.grid_m + 0.5;
  for (; next_ < costs_.size(); ++next_) {
    const double i = static_cast<double>(next_ % static_cast<std::size_t>(side_)) - half;
    const double j = static_cast<double>(next_ / static_cast<std::size_t>(side_) %
                                         static_cast<std::size_t>(side_)) -
                     half;
    if (std::hypot(i, j) > reach) continue;
    if (*used + static_cast<WorkUnits>(kGlance + rough) > granted) {
      status_.done = static_cast<double>(next_) / static_cast<double>(costs_.size());
      return;
    }
    GroundPlace place = on_grid(next_);
    double cost = rough_cost(submap_, map, params_.fit, kGlance, spread_m_, &place, &residuals_);
    *used += static_cast<WorkUnits>(kGlance);
    if (!(cost < kHopeless)) continue;
    cost = rough_cost(submap_, map, params_.fit, rough, spread_m_, &place, &residuals_);
    *used += static_cast<WorkUnits>(rough);
    costs_[next_] = static_cast<float>(cost);
  }
  status_.done = 1.0;
  pick();
}

/// The best hypotheses of the grid, none of them adjacent to a better one.
void InitialLocalizer::pick() {
  followed_.clear();
  const int square = side_ * side_;
  while (followed_.size() < followed_.capacity()) {
    const auto least = std::min_element(costs_.begin(), costs_.end());
    if (!(*least < kOut)) break;
    const auto k = static_cast<int>(least - costs_.begin());
    Followed f;
    f.place = on_grid(static_cast<std::size_t>(k));
    f.spread_m = spread_m_;
    followed_.push_back(f);
    const int h = k / square, j = k % square / side_, i = k % side_;
    for (int hh = std::max(h - 1, 0); hh <= std::min(h + 1, headings_ - 1); ++hh) {
      for (int jj = std::max(j - 1, 0); jj <= std::min(j + 1, side_ - 1); ++jj) {
        for (int ii = std::max(i - 1, 0); ii <= std::min(i + 1, side_ - 1); ++ii) {
          costs_[static_cast<std::size_t>(hh * square + jj * side_ + ii)] = kOut;
        }
      }
    }
  }
  next_ = 0;
  phase_ = Phase::kFollow;
}

void InitialLocalizer::follow(const ElevationMap& map, WorkUnits granted, WorkUnits* used) {
  const WorkUnits look = kLooksForSlope * static_cast<WorkUnits>(submap_.samples.size());
  for (; next_ < followed_.size(); ++next_) {
    Followed& f = followed_[next_];
    if (f.rounds == 0) {
      // The grid has no heights.
      const std::size_t all = submap_.samples.size();
      if (*used + static_cast<WorkUnits>(all) > granted) return;
      *used += static_cast<WorkUnits>(all);
      f.lost = !std::isfinite(
          rough_cost(submap_, map, params_.fit, all, f.spread_m, &f.place, &residuals_));
      ++f.rounds;
    }
    while (!f.lost && f.rounds < params_.rounds) {
      if (*used + look > granted) return;
      *used += look;
      const double moved_m = refine(submap_, map, params_.fit, f.spread_m, &f.place);
      f.lost = moved_m < 0.0;
      const bool exact = f.spread_m == 0.0;
      f.spread_m *= kSpreadSinks;
      if (f.spread_m < kSpreadEnds_m) f.spread_m = 0.0;
      ++f.rounds;
      if (exact && moved_m < kSettled_m) break;
    }
    if (f.lost) continue;
    if (*used + look > granted) {
      f.rounds = params_.rounds;  // refined; only its evaluation remains
      return;
    }
    *used += look;
    f.verdict = judge(submap_, map, params_.fit, f.place);
    f.lost = f.verdict.known < kMinKnown;
  }
  conclude();
}

bool InitialLocalizer::same(const GroundPlace& a, const GroundPlace& b) const {
  return (a.centre_map - b.centre_map).head<2>().norm() < params_.apart_m &&
         std::abs(wrap_angle(a.yaw_rad - b.yaw_rad)) < params_.apart_rad;
}

bool InitialLocalizer::in_region(const Pose& T_map_level) const {
  const Pose T_map_start = T_map_level * T_level_start_;
  const double drifted = params_.drift * status_.travelled_m;
  const double off = (T_map_start.p.head<2>() - region_.middle_m).norm();
  const double turned = std::abs(wrap_angle(yaw_of(T_map_start.q) - region_.yaw_rad));
  return off <= region_.radius_m + params_.grid_m + drifted &&
         turned <= region_.within_rad + params_.apart_rad;
}

void InitialLocalizer::give_up(InitialLocalizationReason reason) {
  phase_ = Phase::kIdle;
  status_.state = InitialLocalizationState::kCollecting;
  status_.reason = reason;
}

void InitialLocalizer::tell(const GroundSubmap& submap, const Followed& best) {
  status_.T_map_level = T_map_level(submap, best.place);
  status_.centre_level = submap.centre_level;
  status_.covariance = best.verdict.covariance;
  status_.covariance.diagonal().head<3>().array() += kFloorSigma_m * kFloorSigma_m;
  status_.covariance.diagonal().tail<3>().array() += kFloorSigma_rad * kFloorSigma_rad;
  status_.cost = best.verdict.cost / std::max(best.verdict.blocks, 1e-9);
  status_.evidence = best.verdict.plane_cost - best.verdict.cost;
}

void InitialLocalizer::conclude() {
  ++status_.searches;
  status_.hypotheses = 0;
  status_.scatter_m = status_.margin = 0.0;
  const auto rank = [](const Followed& f) {
    return f.lost ? std::numeric_limits<double>::infinity() : f.verdict.cost;
  };
  best_ = followed_.size();
  for (std::size_t k = 0; k < followed_.size(); ++k) {
    if (followed_[k].lost) continue;
    if (best_ == followed_.size() || rank(followed_[k]) < rank(followed_[best_])) best_ = k;
  }
  if (best_ == followed_.size()) {
    give_up(followed_.empty() ? InitialLocalizationReason::kNothingFits
                              : InitialLocalizationReason::kNoMap);
    return;
  }
  const Followed& best = followed_[best_];
  double next = std::numeric_limits<double>::infinity();
  double square = 0.0;
  for (const Followed& f : followed_) {
    if (f.lost) continue;
    const bool other = !same(f.place, best.place);
    if (other) next = std::min(next, rank(f));
    if (rank(f) - rank(best) >= params_.evidence) continue;
    if (!other && &f != &best) continue;
    ++status_.hypotheses;
    square += (f.place.centre_map - best.place.centre_map).head<2>().squaredNorm();
  }
  status_.scatter_m = std::sqrt(square / status_.hypotheses);
  status_.margin = next - rank(best);
  tell(submap_, best);
  const bool told = largest_sigma(best.verdict.covariance) <= params_.max_sigma_m &&
                    std::sqrt(best.verdict.covariance(3, 3)) <= params_.max_sigma_rad;
  if (status_.cost > params_.max_cost || !in_region(status_.T_map_level)) {
    give_up(InitialLocalizationReason::kNothingFits);
  } else if (status_.evidence < params_.evidence || !told) {
    give_up(InitialLocalizationReason::kFeatureless);
  } else if (status_.margin < params_.evidence) {
    give_up(InitialLocalizationReason::kAmbiguous);
  } else {
    phase_ = Phase::kAgain;
    compared_at_m_ = searched_at_m_ + params_.confirm_m - kAgainEvery_m;
    status_.state = InitialLocalizationState::kConfirming;
    status_.reason = InitialLocalizationReason::kNone;
  }
}

/// Evaluates ground that was not observed when the candidate was proposed, at the candidate pose.
void InitialLocalizer::confirm(const ElevationMap& map, WorkUnits granted, WorkUnits* used) {
  if (status_.travelled_m < compared_at_m_ + kAgainEvery_m) return;
  if (status_.travelled_m > searched_at_m_ + params_.window_m) {
    give_up(InitialLocalizationReason::kFeatureless);
    return;
  }
  const WorkUnits look = kLooksForSlope * static_cast<WorkUnits>(params_.samples);
  if (*used + look > granted) return;
  *used += look;
  compared_at_m_ = status_.travelled_m;
  patch_.gather(searched_at_m_ + kStep_m, 0.0, &cells_);
  make_submap(cells_, static_cast<std::size_t>(params_.samples), params_.fit, &workspace_, &again_);
  if (again_.samples.empty()) return;
  const GroundVerdict v = judge(again_, map, params_.fit, place_of(again_, status_.T_map_level));
  if (v.known < kMinKnown) {
    give_up(InitialLocalizationReason::kNoMap);
  } else if (v.blocks >= params_.confirm_blocks && v.cost > params_.max_cost * v.blocks) {
    ++status_.refuted;
    give_up(InitialLocalizationReason::kRefuted);
  } else if (v.blocks >= params_.confirm_blocks &&
             v.plane_cost - v.cost >= params_.confirm_evidence) {
    phase_ = Phase::kIdle;
    status_.state = InitialLocalizationState::kFound;
  }
}

Mat<4> InitialLocalizer::covariance_at(const Pose& T_level_vehicle) const {
  const Vec3 arm = status_.T_map_level.q * (T_level_vehicle.p - status_.centre_level);
  Mat<4, 6> J = Mat<4, 6>::Zero();
  J.leftCols<4>().setIdentity();
  J(0, 3) = -arm.y();
  J(1, 3) = arm.x();
  J(2, 4) = arm.x();
  J(2, 5) = arm.y();
  return J * status_.covariance * J.transpose();
}

}  // namespace rcs::sp
