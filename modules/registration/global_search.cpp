#include "modules/registration/global_search.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "rcs/base/check.h"

namespace rcs::registration {
namespace {

constexpr std::size_t kWidest = 0;
constexpr std::size_t kMiddle = 1;
constexpr std::size_t kFinest = 2;
// Iterations at each size, for a start and for the refinement.
constexpr int kStartWidest = 8;
constexpr int kStartMiddle = 6;
constexpr int kFollowMiddle = 8;
constexpr int kFollowFinest = 12;
constexpr double kShare = 0.65;  // of the radius: distance of the starts around the guess

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
      coarse_(static_cast<std::size_t>(params.threads),
              Descent(thinned(source_vehicle, params.points), map, wide.robust)),
      fine_(static_cast<std::size_t>(params.threads),
            Descent(thinned(source_vehicle, wide.points), map, wide.robust)),
      starts_(starts_around(guess, params)),
      hypotheses_(starts_.size()) {
  RCS_CHECK(params.threads == 1 || params.for_all);
}

WorkUnits GlobalSearch::used() const {
  WorkUnits sum = 0;
  for (const Descent& d : coarse_) sum += d.used();
  for (const Descent& d : fine_) sum += d.used();
  return sum;
}

// A descent discards all its matches when it changes the size of voxels: what a thread did before
// makes no difference.
void GlobalSearch::start(Descent* coarse, std::size_t k) {
  Pose T = starts_[k];
  coarse->descend(kWidest, kStartWidest, &T);
  coarse->descend(kMiddle, kStartMiddle, &T);
  hypotheses_[k] = {T, coarse->score(kFinest, T)};
}

void GlobalSearch::follow(Descent* fine, std::size_t k) {
  Hypothesis& h = hypotheses_[k];
  fine->descend(kMiddle, kFollowMiddle, &h.T_target_vehicle);
  fine->descend(kFinest, kFollowFinest, &h.T_target_vehicle);
  h.score = fine->score(kFinest, h.T_target_vehicle);
}

std::size_t GlobalSearch::beside_each_other(std::size_t left,
                                            const std::function<void(std::size_t)>& work) {
  const std::size_t count = std::min(coarse_.size(), left);
  if (count > 1) {
    params_.for_all(count, work);
  } else {
    work(0);
  }
  return count;
}

bool GlobalSearch::go_on(WorkUnits granted) {
  const WorkUnits begin = used();
  const auto enough = [&] { return used() - begin >= granted; };
  while (started_ < starts_.size()) {
    if (enough()) return false;
    started_ += beside_each_other(starts_.size() - started_, [this](std::size_t thread) {
      start(&coarse_[thread], started_ + thread);
    });
    if (started_ == starts_.size()) {
      keep_distinct(params_, static_cast<std::size_t>(params_.followed), &hypotheses_);
    }
  }
  while (followed_ < hypotheses_.size() && !is_done_) {
    if (enough()) return false;
    followed_ += beside_each_other(hypotheses_.size() - followed_, [this](std::size_t thread) {
      follow(&fine_[thread], followed_ + thread);
    });
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
  // The distributions of standard libraries differ.
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

}  // namespace rcs::registration
