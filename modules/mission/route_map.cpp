#include "modules/mission/route_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "rcs/terrain/localizability.h"

namespace rcs::mission {
namespace {

constexpr double kSample_m = 1.0;
constexpr int kMaxCells = 4'000'000;
// Of all speed zones. Those beyond are not regarded by routes; BG keeps their limits anyway.
constexpr std::size_t kMaxSlowCells = 20'000'000;

}  // namespace

void RouteMap::size(const Area& area) {
  low_m_ = area.low_m;
  const Vec2 size = (area.high_m - area.low_m).cwiseMax(0.0);
  // A map that is too large for the cells gets larger ones.
  while (size.x() / params_.cell_m * (size.y() / params_.cell_m) > kMaxCells) {
    params_.cell_m *= 2.0;
  }
  width_ = static_cast<int>(std::ceil(size.x() / params_.cell_m)) + 1;
  height_ = static_cast<int>(std::ceil(size.y() / params_.cell_m)) + 1;
  const auto cells = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  cost_.assign(cells, static_cast<float>(1.0 + params_.unknown));
  poverty_.assign(cells, 1.0F);
  by_zones_.assign(cells, 1.0F);
}

RouteMap::RouteMap(const Area& area, const RouteMapParams& params) : params_(params) { size(area); }

RouteMap::RouteMap(const ElevationMap& map, const Area& area, const RouteMapParams& params)
    : params_(params) {
  size(area);
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) cost_[index({i, j})] = cost_of(map, centre({i, j}));
  }
  const LocalizabilityParams seen;
  const int each =
      std::max(1, static_cast<int>(std::lround(params_.match_each_m / params_.cell_m)));
  for (int j = 0; j < height_; j += each) {
    for (int i = 0; i < width_; i += each) {
      const Cell middle = {std::min(i + each / 2, width_ - 1), std::min(j + each / 2, height_ - 1)};
      const double sigma_m = worst_sigma_m(terrain_information(map, centre(middle), seen));
      const auto poverty = static_cast<float>(std::min(1.0, sigma_m / params_.poor_sigma_m));
      for (int b = j; b < std::min(j + each, height_); ++b) {
        for (int a = i; a < std::min(i + each, width_); ++a) poverty_[index({a, b})] = poverty;
      }
    }
  }
}

Cell RouteMap::cell_at(const Vec2& p_map) const {
  const Vec2 p = (p_map - low_m_) / params_.cell_m;
  return {cell_index(p.x()), cell_index(p.y())};
}

Vec2 RouteMap::centre(Cell c) const { return low_m_ + params_.cell_m * Vec2(c.i + 0.5, c.j + 0.5); }

// The steepest slope between neighbouring heights counts, so that a bank inside a cell is seen.
float RouteMap::cost_of(const ElevationMap& map, const Vec2& centre) const {
  const int n = std::max(2, static_cast<int>(params_.cell_m / kSample_m));
  const double step_m = params_.cell_m / n;
  double steepest = 0.0;
  double largest_m = 0.0;
  int known = 0;
  for (int b = 0; b < n; ++b) {
    for (int a = 0; a < n; ++a) {
      const Vec2 p = centre + step_m * Vec2(a - 0.5 * (n - 1), b - 0.5 * (n - 1));
      Elevation here;
      if (!map.sample(p.x(), p.y(), &here)) continue;
      ++known;
      for (const Vec2& side : {Vec2(step_m, 0.0), Vec2(0.0, step_m)}) {
        Elevation there;
        if (!map.sample(p.x() + side.x(), p.y() + side.y(), &there)) continue;
        // Errors of the map are no ledges.
        const double noise_m = 2.0 * std::hypot(here.sigma_m, there.sigma_m);
        largest_m = std::max(largest_m, std::abs(there.z_m - here.z_m) - noise_m);
      }
      steepest = std::max(steepest, here.gradient.norm());
    }
  }
  if (known == 0) return static_cast<float>(1.0 + params_.unknown);
  const double slope = std::atan(steepest) / params_.max_slope_rad;
  if (slope > 1.0 || largest_m > params_.ledge_m * step_m / kSample_m) return kNever;
  return static_cast<float>(1.0 + params_.slope * slope * slope);
}

ZoneWindow RouteMap::window(Cell first, Cell last) const {
  return {params_.cell_m, first, last.i - first.i + 1, last.j - first.j + 1, 0.0, -low_m_};
}

void RouteMap::set_zones(const Zones& zones, double clearance_m, double speed_mps) {
  std::fill(by_zones_.begin(), by_zones_.end(), 1.0F);
  if (by_zones_.empty()) return;
  std::size_t visited = 0;
  for (const Zone& zone : zones.all()) {
    if (zone.kind != ZoneKind::kSpeed || zone.speed_mps >= speed_mps) continue;
    const auto factor = static_cast<float>(speed_mps / zone.speed_mps);
    Zone inside = zone;
    inside.kind = ZoneKind::kKeepOut;
    const Zones alone({std::move(inside)});
    for (const Zones::Part& part : alone.parts()) {
      Cell first = cell_at(part.box.min());
      Cell last = cell_at(part.box.max());
      first = {std::max(first.i, 0), std::max(first.j, 0)};
      last = {std::min(last.i, width_ - 1), std::min(last.j, height_ - 1)};
      if (first.i > last.i || first.j > last.j) continue;
      const ZoneWindow cells = window(first, last);
      visited += static_cast<std::size_t>(cells.width) * static_cast<std::size_t>(cells.height);
      if (visited > kMaxSlowCells) break;
      const std::vector<std::uint8_t>& slow = raster_.forbidden(alone, cells, 0.0);
      for (int j = 0; j < cells.height; ++j) {
        for (int i = 0; i < cells.width; ++i) {
          if (slow[static_cast<std::size_t>(j * cells.width + i)] == 0) continue;
          float& by = by_zones_[index({first.i + i, first.j + j})];
          by = std::max(by, factor);
        }
      }
    }
  }
  if (!zones.forbids()) return;
  const std::vector<std::uint8_t>& forbidden =
      raster_.forbidden(zones, window({0, 0}, {width_ - 1, height_ - 1}), clearance_m);
  for (std::size_t k = 0; k < by_zones_.size(); ++k) {
    if (forbidden[k] != 0) by_zones_[k] = kNever;
  }
}

void RouteMap::block(const Vec2& p_map, double radius_m) {
  const Cell low = cell_at(p_map - Vec2::Constant(radius_m));
  const Cell high = cell_at(p_map + Vec2::Constant(radius_m));
  for (int j = std::max(low.j, 0); j <= std::min(high.j, height_ - 1); ++j) {
    for (int i = std::max(low.i, 0); i <= std::min(high.i, width_ - 1); ++i) {
      float& cost = cost_[index({i, j})];
      if ((centre({i, j}) - p_map).norm() > radius_m || cost == kNever) continue;
      blocked_.push_back({index({i, j}), cost});
      cost = kNever;
    }
  }
}

void RouteMap::unblock() {
  for (const Blocked& b : blocked_) cost_[b.cell] = b.cost;
  blocked_.clear();
}

}  // namespace rcs::mission
