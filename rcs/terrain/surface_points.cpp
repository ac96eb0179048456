#include "rcs/terrain/surface_points.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <set>

#include "rcs/base/check.h"

namespace rcs {
namespace {

Points places_of(const std::vector<SurfacePoint>& points) {
  Points out;
  out.reserve(points.size());
  for (const SurfacePoint& p : points) out.push_back(p.p_m);
  return out;
}

}  // namespace

Outcome check_surface_points(const std::vector<SurfacePoint>& points, double wide_m,
                             double high_m) {
  constexpr float kUnit = 1e-3F;
  for (const SurfacePoint& p : points) {
    const bool inside = p.p_m.x() >= 0.0F && p.p_m.x() <= wide_m && p.p_m.y() >= 0.0F &&
                        p.p_m.y() <= high_m && std::abs(p.p_m.z()) <= 20000.0F;
    if (!inside) return Error{"a surface point is outside its tile, or its height is beyond 20 km"};
    if (!(std::abs(p.normal.norm() - 1.0F) <= kUnit)) {
      return Error{"a surface point's normal is not of length 1"};
    }
    if (!(p.sigma_m > 0.0F && p.sigma_m <= 1000.0F)) {
      return Error{"a surface point's sigma is not in (0, 1000] m"};
    }
  }
  return Done{};
}

std::vector<SurfacePoint> thinned(const std::vector<SurfacePoint>& points, double voxel_m,
                                  std::size_t most) {
  RCS_CHECK(voxel_m > 0.0);
  while (true) {
    std::vector<SurfacePoint> kept;
    std::set<std::array<std::int64_t, 3>> taken;
    for (const SurfacePoint& p : points) {
      const auto place = [voxel_m](float v) {
        return static_cast<std::int64_t>(std::floor(static_cast<double>(v) / voxel_m));
      };
      if (taken.insert({place(p.p_m.x()), place(p.p_m.y()), place(p.p_m.z())}).second) {
        kept.push_back(p);
      }
    }
    if (kept.size() <= most) return kept;
    voxel_m *= 2.0;
  }
}

SurfaceIndex::Tree::Tree(const std::vector<SurfacePoint>& points)
    : p_m(places_of(points)), tree(p_m) {}

void SurfaceIndex::load(const std::vector<SurfacePoint>& points) {
  tree_.reset();
  points_ = points;
  if (!points_.empty()) tree_ = std::make_unique<Tree>(points_);
}

}  // namespace rcs
