#include "modules/registration/range_view.h"

#include <algorithm>
#include <cmath>

namespace rcs::registration {
namespace {

// The directions are projected on the faces of a cube, which needs no trigonometry.
constexpr int kCells = 60;  // along an edge: 1.9 deg in the middle of a face, 1 deg at its edges
// Ranges within a cell differ on oblique surfaces, and both scans have noise.
constexpr float kMargin_m = 0.3F;
constexpr float kMarginShare = 0.02F;

// Farther points would not fit the integer arithmetic; no LADAR has them.
constexpr float kFarthest_m = 1e6F;

bool is_near(const Vec3f& p) { return p.cwiseAbs().maxCoeff() < kFarthest_m; }

std::size_t cell_of(const Vec3f& p) {
  Vec3f::Index axis = 0;
  const float most = p.cwiseAbs().maxCoeff(&axis);
  const float scale = 0.5F * static_cast<float>(kCells) / std::max(most, 1e-6F);
  const auto along = [scale](float v) {
    return std::min(kCells - 1, static_cast<int>(v * scale + 0.5F * static_cast<float>(kCells)));
  };
  const auto face = static_cast<int>(axis) * 2 + (p[axis] > 0.0F ? 1 : 0);
  const int u = along(p[(axis + 1) % 3]);
  const int v = along(p[(axis + 2) % 3]);
  return static_cast<std::size_t>((face * kCells + u) * kCells + v);
}

}  // namespace

RangeView::RangeView(const Points& points_sensor) : nearest_m_(6UL * kCells * kCells, 0.0F) {
  for (std::size_t i = 0; i < points_sensor.size(); ++i) {
    const Vec3f p = points_sensor[i];
    if (!is_near(p)) continue;
    const float range = p.norm();
    float& nearest = nearest_m_[cell_of(p)];
    if (nearest == 0.0F || range < nearest) nearest = range;
  }
}

bool RangeView::passed_through(const Vec3f& p) const {
  if (!is_near(p)) return false;
  const float nearest = nearest_m_[cell_of(p)];
  const float range = p.norm();
  return nearest > 0.0F && range > kMargin_m && range + kMargin_m + kMarginShare * range < nearest;
}

}  // namespace rcs::registration
