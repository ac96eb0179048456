#include "sim/terrain/scatter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/base/hash.h"

namespace rcs::sim {
namespace {

int poisson(double mean, PlaceRandom* random) {
  const double limit = std::exp(-mean);
  int n = 0;
  for (double p = random->next(); p > limit; p *= random->next()) ++n;
  return n;
}

std::uint64_t square_key(int i, int j) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U) |
         static_cast<std::uint32_t>(j);
}

int metre(double x_m) { return static_cast<int>(std::floor(x_m)); }

}  // namespace

Vec3 Spheroid::centre_at(double time_s, double sway_hz) const {
  if (sway_m == 0.0) return centre_world;
  // Two frequencies without a common period: the sway never repeats exactly.
  const double a = 2.0 * kPi * sway_hz * time_s + phase_rad;
  return centre_world + sway_m * Vec3(std::sin(a), std::sin(0.77 * a + 1.3), 0.0);
}

Scatter::Scatter(std::uint64_t seed, const RockParams& rocks, const VegetationParams& vegetation,
                 const std::vector<Vec2>& course_world, double clear_m, std::vector<Road> roads)
    : seed_(seed), rocks_(rocks), vegetation_(vegetation), roads_(std::move(roads)) {
  const int margin = static_cast<int>(std::ceil(clear_m));
  for (const Vec2& p : course_world) {
    for (int j = -margin; j <= margin; ++j) {
      for (int i = -margin; i <= margin; ++i) {
        near_course_.push_back(square_key(metre(p.x()) + i, metre(p.y()) + j));
      }
    }
  }
  std::sort(near_course_.begin(), near_course_.end());
  near_course_.erase(std::unique(near_course_.begin(), near_course_.end()), near_course_.end());
}

bool Scatter::clear_of_ways(double x_m, double y_m, double radius_m) const {
  if (distance_from_road(roads_, x_m, y_m) < radius_m) return false;
  for (int j = metre(y_m - radius_m); j <= metre(y_m + radius_m); ++j) {
    for (int i = metre(x_m - radius_m); i <= metre(x_m + radius_m); ++i) {
      if (std::binary_search(near_course_.begin(), near_course_.end(), square_key(i, j))) {
        return false;
      }
    }
  }
  return true;
}

bool Scatter::meadow(double x_m, double y_m) const {
  return Relief::field(mix(seed_ + 11), vegetation_.patch_m, x_m, y_m) > 0.0 &&
         distance_from_road(roads_, x_m, y_m) > 0.0;
}

void Scatter::fill_meadow(std::int64_t i0, std::int64_t j0, double step_m, int side,
                          std::vector<float>* values) const {
  Relief::fill_field(mix(seed_ + 11), vegetation_.patch_m, i0, j0, step_m, side, values);
  if (roads_.empty()) return;
  std::size_t at = 0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i, ++at) {
      const double x_m = static_cast<double>(i0 + i) * step_m;
      const double y_m = static_cast<double>(j0 + j) * step_m;
      if (distance_from_road(roads_, x_m, y_m) <= 0.0) (*values)[at] = -1.0F;
    }
  }
}

void Scatter::grow(int i, int j, int into_i, int into_j, double size_m, const Relief& relief,
                   std::vector<Spheroid>* out) const {
  const VegetationParams& veg = vegetation_;
  PlaceRandom random(hash_cell(mix(seed_ + 23), i, j));
  const double area_m2 = size_m * size_m;
  const auto place = [&] {
    const double x = (i + random.next()) * size_m;
    return Vec3(x, (j + random.next()) * size_m, 0.0);
  };
  // The noise fields are the most expensive part: evaluated last, and only within range.
  const auto reaches = [&](const Vec3& p, double radius_m) {
    const Vec2 middle = size_m * Vec2(into_i + 0.5, into_j + 0.5);
    return (p.head<2>() - middle).cwiseAbs().maxCoeff() <= 0.5 * size_m + radius_m + veg.sway_m;
  };
  const auto stand = [&relief](Vec3* p) { p->z() = relief.height(p->x(), p->y()); };

  for (int n = poisson(rocks_.per_m2 * area_m2, &random); n > 0; --n) {
    // The density of radii falls as 1/r^2: many small rocks, few large ones.
    const double radius_m =
        1.0 / random.uniform(1.0 / rocks_.radius_max_m, 1.0 / rocks_.radius_min_m);
    const double half_height_m = radius_m * random.uniform(0.5, 1.0);
    Vec3 p = place();
    if (!reaches(p, radius_m) || !clear_of_ways(p.x(), p.y(), radius_m)) continue;
    stand(&p);
    out->push_back({p, radius_m, half_height_m, 0.0, 0.0, 0.0});
  }
  // Half of the ground is meadow, so twice the mean number is drawn.
  const double extinction_1pm = -std::log(veg.transmittance_per_m);
  for (int n = poisson(2.0 * veg.bushes_per_m2 * area_m2, &random); n > 0; --n) {
    const double radius_m = random.uniform(0.4, 1.2);
    const double half_height_m = radius_m * random.uniform(0.7, 1.2);
    const double phase_rad = random.uniform(0.0, 2.0 * kPi);
    Vec3 p = place();
    if (!reaches(p, radius_m) || !clear_of_ways(p.x(), p.y(), radius_m) || meadow(p.x(), p.y())) {
      continue;
    }
    stand(&p);
    p.z() += 0.7 * half_height_m;
    out->push_back({p, radius_m, half_height_m, extinction_1pm, 0.3 * veg.sway_m, phase_rad});
  }
  for (int n = poisson(2.0 * veg.trees_per_m2 * area_m2, &random); n > 0; --n) {
    const double height_m = random.uniform(4.0, 12.0);
    const double crown_m = height_m * random.uniform(0.15, 0.25);
    const double trunk_m = 0.02 * height_m + 0.05;
    const double phase_rad = random.uniform(0.0, 2.0 * kPi);
    Vec3 p = place();
    if (!reaches(p, crown_m) || !clear_of_ways(p.x(), p.y(), crown_m) || meadow(p.x(), p.y())) {
      continue;
    }
    stand(&p);
    out->push_back({p, trunk_m, 0.9 * height_m, 0.0, 0.0, 0.0});
    p.z() += 0.65 * height_m;
    out->push_back({p, crown_m, 0.35 * height_m, extinction_1pm, veg.sway_m, phase_rad});
  }
}

}  // namespace rcs::sim
