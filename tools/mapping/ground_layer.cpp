#include "tools/mapping/ground_layer.h"

#include <algorithm>
#include <cmath>

namespace rcs::mapping {
namespace {

constexpr int kLayers = HeightCounts::kLayers;
constexpr double kStuff_m = 0.4;  // maximum height of grass
constexpr double kMinShare = 0.02;
constexpr double kMinSigma_m = 0.012;
constexpr double kMaxSigma_m = 0.08;

/// Density of vegetation: uniform above the ground.
double stuff(double off_m, double sigma_m) {
  if (off_m > kStuff_m) return 0.0;
  return 0.5 * std::erfc(-off_m / (std::sqrt(2.0) * sigma_m)) / kStuff_m;
}

double bell(double off_m, double sigma_m) {
  constexpr double kRoot2Pi = 2.5066282746310002;
  return std::exp(-0.5 * off_m * off_m / (sigma_m * sigma_m)) / (kRoot2Pi * sigma_m);
}

}  // namespace

bool HeightCounts::add(double above_m, int weight_of) {
  const double layer = std::floor((above_m - kLowest_m) / kLayer_m);
  if (!(layer >= 0.0 && layer < kLayers)) return false;
  std::uint16_t& w = weight[static_cast<std::size_t>(layer)];
  constexpr int kFull = 65535;
  if (w + weight_of > kFull) {
    // Only shares matter.
    for (std::uint16_t& v : weight) v = static_cast<std::uint16_t>(v / 2);
  }
  w = static_cast<std::uint16_t>(w + weight_of);
  if (returns < kFull) ++returns;
  return true;
}

double GroundLayer::is_ground(double height_m) const {
  const double off_m = height_m - above_m;
  const double ground = share * bell(off_m, sigma_m);
  const double other = (1.0 - share) * stuff(off_m, sigma_m);
  // Far below the ground both densities vanish: neither ground nor vegetation.
  constexpr double kFar = 4.0;
  return std::abs(off_m) > kFar * sigma_m ? 0.0 : ground / (ground + other);
}

std::optional<GroundLayer> find_ground(const std::array<double, kLayers>& weight, double least) {
  constexpr double kFairShare = 0.1;
  constexpr int kReach = 2;
  constexpr int kRounds = 12;
  double all = 0.0;
  for (const double w : weight) all += w;
  if (all < least) return std::nullopt;
  const auto at = [&](int k) {
    return k < 0 || k >= kLayers ? 0.0 : weight[static_cast<std::size_t>(k)];
  };
  const auto smooth = [&](int k) {
    return 3.0 * at(k) + 2.0 * (at(k - 1) + at(k + 1)) + at(k - 2) + at(k + 2);
  };
  int start = -1;
  for (int k = 0; k < kLayers && start < 0; ++k) {
    const double here = smooth(k);
    if (here <= 0.0 || here < smooth(k - 1) || here < smooth(k + 1)) continue;
    double mass = 0.0;
    for (int a = k - kReach; a <= k + kReach; ++a) mass += at(a);
    if (mass >= std::max(least, kFairShare * all)) start = k;
  }
  if (start < 0) return std::nullopt;

  constexpr double kBelow_m = 0.12;
  constexpr double kFirstSigma_m = 0.025;
  GroundLayer g{HeightCounts::middle_m(start), kFirstSigma_m, 0.5};
  for (int round = 0; round < kRounds; ++round) {
    double sum = 0.0;
    double sum_z = 0.0;
    double sum_zz = 0.0;
    double near = 0.0;
    for (int k = 0; k < kLayers; ++k) {
      const double w = at(k);
      const double off_m = HeightCounts::middle_m(k) - g.above_m;
      if (w == 0.0 || off_m < -kBelow_m || off_m > kStuff_m) continue;
      near += w;
      const double r = w * g.is_ground(HeightCounts::middle_m(k));
      sum += r;
      sum_z += r * off_m;
      sum_zz += r * off_m * off_m;
    }
    if (sum <= 0.0) return std::nullopt;
    const double mean = sum_z / sum;
    const double variance = sum_zz / sum - mean * mean;
    g.above_m += mean;
    g.sigma_m = std::clamp(std::sqrt(std::max(0.0, variance)), kMinSigma_m, kMaxSigma_m);
    g.share = std::clamp(sum / near, kMinShare, 0.99);
  }
  return g;
}

}  // namespace rcs::mapping
