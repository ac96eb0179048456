#include "tools/studies/scan_pairs.h"

#include <algorithm>
#include <cmath>

namespace rcs::studies {
namespace {

constexpr Offset kNavigation = {0.3, radians(1.0)};
constexpr int kSigns = 16;  // combinations of signs of yaw, x, y and z
constexpr unsigned kSeedStride = 1000;

bool belongs(DataSet set, const ScanPair& pair) {
  const bool far = set == DataSet::kTwentyApart || set == DataSet::kMovedBy1m;
  return pair.data - pair.model == (far ? kApart : 1);
}

Vec3 random_direction(std::mt19937* rng) {
  std::normal_distribution<double> normal;
  const double x = normal(*rng);
  const double y = normal(*rng);
  return Vec3(x, y, normal(*rng)).normalized();
}

std::mt19937 generator(const ScanPair& pair, int seed) {
  return std::mt19937(kSeedStride * static_cast<unsigned>(seed) +
                      static_cast<unsigned>(pair.model));
}

/// Consecutive pairs, with errors of the guesses drawn by `offset`.
template <class Draw>
std::vector<Trial> near_truth(const std::vector<ScanPair>& pairs, int seeds, const Draw& offset) {
  std::vector<Trial> trials;
  for (const ScanPair& pair : pairs) {
    if (!belongs(DataSet::kConsecutive, pair)) continue;
    for (int seed = 0; seed < seeds; ++seed) {
      std::mt19937 rng = generator(pair, seed);
      trials.push_back({pair, pair.T_model_data * offset(&rng)});
    }
  }
  return trials;
}

Pose guess_of(DataSet set, const ScanPair& pair, int seed) {
  if (set == DataSet::kConsecutive) return Pose{};
  if (set == DataSet::kTurnedAndMovedBy3m) {
    const auto sign = [seed](int bit) { return (seed >> bit & 1) != 0 ? 1.0 : -1.0; };
    return {exp_so3(Vec3(0.0, 0.0, sign(0) * radians(10.0))),
            3.0 * Vec3(sign(1), sign(2), sign(3))};
  }
  std::mt19937 rng = generator(pair, seed);
  Pose guess = pair.T_model_data * random_offset(kNavigation, &rng);
  if (set == DataSet::kMovedBy1m) guess.p += Vec3::Ones();
  return guess;
}

}  // namespace

Pose random_offset(const Offset& offset, std::mt19937* rng) {
  const Vec3 direction = random_direction(rng);
  return {exp_so3(offset.rad * random_direction(rng)), offset.m * direction};
}

std::vector<Trial> trials_of(DataSet set, const std::vector<ScanPair>& pairs, int seeds) {
  if (set == DataSet::kConsecutive) seeds = 1;
  if (set == DataSet::kTurnedAndMovedBy3m) seeds = std::min(seeds, kSigns);
  std::vector<Trial> trials;
  for (const ScanPair& pair : pairs) {
    if (!belongs(set, pair)) continue;
    for (int seed = 0; seed < seeds; ++seed) trials.push_back({pair, guess_of(set, pair, seed)});
  }
  return trials;
}

std::vector<Trial> basin_trials(const std::vector<ScanPair>& pairs, const Offset& offset,
                                int seeds) {
  return near_truth(pairs, seeds,
                    [&offset](std::mt19937* rng) { return random_offset(offset, rng); });
}

std::vector<Trial> global_trials(const std::vector<ScanPair>& pairs, double radius_m,
                                 double tilt_rad, int seeds) {
  return near_truth(pairs, seeds, [&](std::mt19937* rng) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const double heading = kPi * uniform(*rng);
    const double roll = tilt_rad * uniform(*rng);
    const double pitch = tilt_rad * uniform(*rng);
    const double bearing = kPi * uniform(*rng);
    const double distance_m = radius_m * std::sqrt(0.5 + 0.5 * uniform(*rng));
    return Pose{exp_so3(Vec3(0.0, 0.0, heading)) * exp_so3(Vec3(0.0, pitch, 0.0)) *
                    exp_so3(Vec3(roll, 0.0, 0.0)),
                distance_m * Vec3(std::cos(bearing), std::sin(bearing), 0.0)};
  });
}

Offset error_of(const Pose& truth, const Pose& answer) {
  const Pose off = truth.inverse() * answer;
  return {off.p.norm(), log_so3(off.q).norm()};
}

bool is_success(const Offset& error) { return error.m < 0.1 && error.rad < radians(0.5); }

}  // namespace rcs::studies
