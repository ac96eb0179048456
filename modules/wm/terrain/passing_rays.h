#pragma once
// The rays of one scan by their direction, to find those that pass through a place.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::wm {

class PassingRays {
 public:
  /// Rays beyond this number are not kept.
  void reserve(std::size_t rays) { rays_.reserve(rays); }

  void clear() {
    rays_.clear();
    head_.fill(kNone);
  }

  void add(const Vec3& from, const Vec3& to) {
    if (rays_.size() == rays_.capacity()) return;
    const Vec3 way = to - from;
    const double level_m = way.head<2>().norm();
    if (level_m < 0.1) return;
    const auto azimuth = static_cast<float>(std::atan2(way.y(), way.x()));
    int& head = head_[static_cast<std::size_t>(bin_of(azimuth))];
    rays_.push_back(
        {azimuth, static_cast<float>(level_m), static_cast<float>(way.z() / level_m), head});
    head = static_cast<int>(rays_.size()) - 1;
  }

  /// Calls each(rise per metre of horizontal distance) for the rays that pass a vertical line, to
  /// both sides within `half_m`, and end at least `beyond_m` behind it.
  /// @param place  of the line, from where the rays begin
  template <typename Each>
  void passing(const Vec2& place, double half_m, double beyond_m, Each&& each) const {
    const double away_m = place.norm();
    if (away_m < 2.0 * half_m) return;
    const auto azimuth = static_cast<float>(std::atan2(place.y(), place.x()));
    const auto half = static_cast<float>(half_m / away_m);
    const int first = bin_of(azimuth - half);
    const int count = (bin_of(azimuth + half) - first + kBins) % kBins;
    for (int n = 0; n <= count; ++n) {
      const auto bin = static_cast<std::size_t>((first + n) % kBins);
      for (int k = head_[bin]; k != kNone; k = rays_[static_cast<std::size_t>(k)].next) {
        const Ray& ray = rays_[static_cast<std::size_t>(k)];
        const float off = std::remainder(ray.azimuth - azimuth, static_cast<float>(2.0 * kPi));
        if (std::abs(off) <= half && ray.level_m >= away_m + beyond_m) each(ray.rise);
      }
    }
  }

 private:
  static constexpr int kBins = 1024;
  static constexpr int kNone = -1;
  struct Ray {
    float azimuth;
    float level_m;  // horizontal length
    float rise;     // per metre of it
    int next;       // in the same bin
  };
  static int bin_of(float azimuth) {
    const double turns = azimuth / (2.0 * kPi) + 1.0;
    return static_cast<int>(std::floor((turns - std::floor(turns)) * kBins)) % kBins;
  }

  std::vector<Ray> rays_;
  std::array<int, kBins> head_{};
};

}  // namespace rcs::wm
