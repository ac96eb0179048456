#include "rcs/zones/zone_raster.h"

#include <algorithm>
#include <cmath>

#include "rcs/zones/capsule.h"

namespace rcs {
namespace {

constexpr std::int32_t kBand = 1 << 16;  // 20,000 edges and polygons fit below and above it

/// The first index that is not less than `x`, limited to [0, size].
int index_from(double x, int size) {
  return static_cast<int>(std::clamp(std::ceil(x), 0.0, static_cast<double>(size)));
}

}  // namespace

const std::vector<std::uint8_t>& ZoneRaster::forbidden(const Zones& zones, const ZoneWindow& window,
                                                       double clearance_m) {
  window_ = window;
  cos_ = std::cos(window.yaw_rad);
  sin_ = std::sin(window.yaw_rad);
  const std::size_t width = static_cast<std::size_t>(window.width);
  const std::size_t height = static_cast<std::size_t>(window.height);
  steps_.resize((width + 1) * height);
  covered_.resize(width * height);
  forbidden_.assign(width * height, 0);
  const auto has = [&](ZoneKind kind) {
    return std::any_of(zones.parts().begin(), zones.parts().end(),
                       [kind](const Zones::Part& part) { return part.kind == kind; });
  };
  if (has(ZoneKind::kKeepOut)) {
    cover(zones, ZoneKind::kKeepOut, -clearance_m);
    forbidden_ = covered_;
  }
  if (has(ZoneKind::kFence)) {
    cover(zones, ZoneKind::kFence, clearance_m);
    for (std::size_t k = 0; k < forbidden_.size(); ++k) {
      if (covered_[k] == 0) forbidden_[k] = 1;
    }
  }
  return forbidden_;
}

Vec2 ZoneRaster::in_cells(const Vec2& p_world) const {
  const double x_m = cos_ * p_world.x() - sin_ * p_world.y() + window_.origin_m.x();
  const double y_m = sin_ * p_world.x() + cos_ * p_world.y() + window_.origin_m.y();
  return {x_m / window_.cell_m - window_.first.i - 0.5,
          y_m / window_.cell_m - window_.first.j - 0.5};
}

void ZoneRaster::cover(const Zones& zones, ZoneKind kind, double depth_m) {
  std::fill(covered_.begin(), covered_.end(), std::uint8_t{0});
  const double band_m = std::abs(depth_m);
  // The window in frame world: the box of its four corners.
  Box2 around;
  for (const int i : {0, window_.width}) {
    for (const int j : {0, window_.height}) {
      const double x_m = (window_.first.i + i) * window_.cell_m - window_.origin_m.x();
      const double y_m = (window_.first.j + j) * window_.cell_m - window_.origin_m.y();
      around.extend(Vec2(cos_ * x_m + sin_ * y_m, -sin_ * x_m + cos_ * y_m));
    }
  }
  const Vec2 wide(band_m, band_m);
  around = Box2(around.min() - wide, around.max() + wide);
  const auto concerns = [&](const Zones::Part& part) {
    return part.kind == kind && part.box.intersects(around);
  };
  const auto row = [&](int j) {
    return covered_.begin() + static_cast<std::ptrdiff_t>(j) * window_.width;
  };
  if (depth_m > 0.0) {
    // Inside a polygon and not near to its own border: each polygon alone, as a border within
    // another polygon is none.
    for (const Zones::Part& part : zones.parts()) {
      if (!concerns(part)) continue;
      std::fill(steps_.begin(), steps_.end(), 0);
      add(zones, part, around, band_m);
      each_sum([&](int i, int j, std::int32_t sum) {
        if (sum == 1) row(j)[i] = 1;
      });
    }
    return;
  }
  std::fill(steps_.begin(), steps_.end(), 0);
  bool any = false;
  for (const Zones::Part& part : zones.parts()) {
    if (!concerns(part)) continue;
    any = true;
    add(zones, part, around, band_m);
  }
  if (!any) return;
  each_sum([&](int i, int j, std::int32_t sum) {
    if (sum > 0) row(j)[i] = 1;
  });
}

template <class Use>
void ZoneRaster::each_sum(Use&& use) const {
  const std::int32_t* step = steps_.data();
  for (int j = 0; j < window_.height; ++j) {
    std::int32_t sum = 0;
    for (int i = 0; i < window_.width; ++i) {
      sum += *step++;
      use(i, j, sum);
    }
    ++step;
  }
}

void ZoneRaster::add(const Zones& zones, const Zones::Part& part, const Box2& around,
                     double band_m) {
  zones.each_line(part, around, [&](const Vec2& a_world, const Vec2& b_world, bool is_edge) {
    const Vec2 a = in_cells(a_world);
    const Vec2 b = in_cells(b_world);
    add_crossings(a, b);
    if (is_edge && band_m > 0.0) add_band(a, b, band_m / window_.cell_m);
  });
}

void ZoneRaster::add_crossings(const Vec2& a, const Vec2& b) {
  const Vec2& low = a.y() < b.y() ? a : b;
  const Vec2& high = a.y() < b.y() ? b : a;
  const std::int32_t step = a.y() < b.y() ? -1 : 1;  // on the right of an edge that leads upwards
  const int end = index_from(high.y(), window_.height);
  for (int j = index_from(low.y(), window_.height); j < end; ++j) {
    const double share = (j - low.y()) / (high.y() - low.y());
    const int i = index_from(low.x() + share * (high.x() - low.x()), window_.width);
    steps_[static_cast<std::size_t>(j) * static_cast<std::size_t>(window_.width + 1) +
           static_cast<std::size_t>(i)] += step;
  }
}

void ZoneRaster::add_band(const Vec2& a, const Vec2& b, double radius) {
  const Capsule capsule(a, b, radius);
  const double low = std::min(a.y(), b.y()) - radius;
  const double high = std::max(a.y(), b.y()) + radius;
  if (std::min(a.x(), b.x()) - radius > window_.width || std::max(a.x(), b.x()) + radius < 0.0) {
    return;
  }
  const int end = index_from(high, window_.height);
  for (int j = index_from(low, window_.height); j < end; ++j) {
    const Span span = capsule.on_line(Vec2(0.0, j), Vec2::UnitX());
    if (span.empty()) continue;
    std::int32_t* const row =
        &steps_[static_cast<std::size_t>(j) * static_cast<std::size_t>(window_.width + 1)];
    row[index_from(span.first, window_.width)] += kBand;
    // The end of a row has a step of its own.
    row[index_from(span.last, window_.width)] -= kBand;
  }
}

}  // namespace rcs
