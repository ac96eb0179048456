#include "modules/sp/multistart.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace rcs::sp {
namespace {

constexpr std::size_t kWidest = 0;
constexpr std::size_t kMiddle = 1;
constexpr std::size_t kFinest = 2;
// Iterations at each size: as a start, and when it is followed.
constexpr int kStartWidest = 8;
constexpr int kStartMiddle = 6;
constexpr int kFollowMiddle = 8;
constexpr int kFollowFinest = 12;
constexpr double kShare = 0.65;  // of the radius, where the starts around the guess are

std::vector<Pose> starts_around(const Pose& guess, const GlobalParams& p) {
  std::vector<Pose> starts;
  for (int k = 0; k < p.headings; ++k) {
    const double heading = 2.0 * kPi * k / p.headings;
    const Quat q = (guess.q * exp_so3(Vec3(0.0, 0.0, heading))).normalized();
    starts.push_back({q, guess.p});
    for (int n = 0; n < p.around; ++n) {
      const double way = 2.0 * kPi * n / p.around;
      const Vec3 off = kShare * p.radius_m * Vec3(std::cos(way), std::sin(way), 0.0);
      starts.push_back({q, guess.p + off});
    }
  }
  if (p.tilt_rad == 0.0) return starts;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3 turn = p.tilt_rad * Vec3(x, y, z).normalized();
        starts.push_back({(guess.q * exp_so3(turn)).normalized(), guess.p});
      }
    }
  }
  return starts;
}

bool are_one(const Pose& a, const Pose& b, const GlobalParams& p) {
  return (a.p - b.p).norm() < p.apart_m && log_so3(a.q.conjugate() * b.q).norm() < p.apart_rad;
}

}  // namespace

void keep_distinct(const GlobalParams& params, std::size_t most, std::vector<Hypothesis>* list) {
  std::stable_sort(list->begin(), list->end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  std::size_t kept = 0;
  for (const Hypothesis& h : *list) {
    const auto end = list->begin() + static_cast<std::ptrdiff_t>(kept);
    const bool is_new = std::none_of(list->begin(), end, [&](const Hypothesis& better) {
      return are_one(h.T_target_vehicle, better.T_target_vehicle, params);
    });
    if (is_new && kept < most) (*list)[kept++] = h;
  }
  list->resize(kept);
}

GlobalSearch::GlobalSearch(const Points& source_vehicle, const WideMap* map, const Pose& guess,
                           const GlobalParams& params, const WideParams& wide)
    : params_(params),
      coarse_(thinned(source_vehicle, params.points), map, wide.robust),
      fine_(thinned(source_vehicle, wide.points), map, wide.robust),
      starts_(starts_around(guess, params)) {
  hypotheses_.reserve(starts_.size());
}

bool GlobalSearch::go_on(WorkUnits granted) {
  const WorkUnits begin = used();
  for (; started_ < starts_.size(); ++started_) {
    if (used() - begin >= granted) return false;
    Pose T = starts_[started_];
    coarse_.descend(kWidest, kStartWidest, &T);
    coarse_.descend(kMiddle, kStartMiddle, &T);
    hypotheses_.push_back({T, coarse_.score(kFinest, T)});
    if (started_ + 1 == starts_.size()) {
      keep_distinct(params_, static_cast<std::size_t>(params_.followed), &hypotheses_);
    }
  }
  for (; followed_ < hypotheses_.size() && !is_done_; ++followed_) {
    if (used() - begin >= granted) return false;
    Hypothesis& h = hypotheses_[followed_];
    fine_.descend(kMiddle, kFollowMiddle, &h.T_target_vehicle);
    fine_.descend(kFinest, kFollowFinest, &h.T_target_vehicle);
    h.score = fine_.score(kFinest, h.T_target_vehicle);
  }
  if (!is_done_) keep_distinct(params_, static_cast<std::size_t>(params_.ranked), &hypotheses_);
  is_done_ = true;
  return true;
}

Hypothesis anneal(const Points& source_vehicle, const WideMap& map, const Pose& guess,
                  const AnnealParams& params, const GlobalParams& global, const WideParams& wide,
                  WorkUnits* used) {
  Descent coarse(thinned(source_vehicle, global.points), &map, wide.robust);
  std::mt19937 rng(params.seed);
  // Not the library's distributions: each has its own.
  const auto uniform = [&rng] { return (static_cast<double>(rng()) + 0.5) / 4294967296.0; };
  const auto normal = [&uniform] {
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * kPi * uniform());
  };
  Hypothesis now{guess, coarse.score(kFinest, guess)};
  Hypothesis best = now;
  for (int k = 0; k < params.moves; ++k) {
    const double cooling = static_cast<double>(k) / params.moves;
    const double temperature = params.hot * std::pow(params.cold / params.hot, cooling);
    const double scale = 1.0 - 0.9 * cooling;
    const Vec3 turn(scale * params.tilt_sigma_rad * normal(),
                    scale * params.tilt_sigma_rad * normal(), scale * params.sigma_rad * normal());
    const Vec3 off(scale * params.sigma_m * normal(), scale * params.sigma_m * normal(), 0.0);
    Pose T{(now.T_target_vehicle.q * exp_so3(turn)).normalized(), now.T_target_vehicle.p + off};
    if ((T.p - guess.p).norm() > 2.0 * global.radius_m) continue;
    coarse.descend(kWidest, 2, &T);
    coarse.descend(kMiddle, 3, &T);
    const Hypothesis next{T, coarse.score(kFinest, T)};
    if (next.score > best.score) best = next;
    if (uniform() < std::exp((next.score - now.score) / temperature)) now = next;
  }
  Descent fine(thinned(source_vehicle, wide.points), &map, wide.robust);
  fine.descend(kMiddle, kFollowMiddle, &best.T_target_vehicle);
  fine.descend(kFinest, kFollowFinest, &best.T_target_vehicle);
  best.score = fine.score(kFinest, best.T_target_vehicle);
  if (used != nullptr) *used = coarse.used() + fine.used();
  return best;
}

}  // namespace rcs::sp
