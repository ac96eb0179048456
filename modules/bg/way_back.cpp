#include "modules/bg/way_back.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace rcs::bg {
namespace {

constexpr double kFarthest_m = 2.0;  // off_route_m of all other ground
constexpr double kEach_m = 0.4;      // points of the path
constexpr float kStep_m = 0.1F;      // of an object that was observed
constexpr double kOn_m = 0.8;        // of the line: the vehicle is on the way
constexpr double kOn_rad = 0.5;
// Than the vehicle can turn: the noise of the places in its sharpest turns. It then deviates from
// the curve by some decimetres; a corner or a reversal is much sharper.
constexpr double kSharper = 3.0;
constexpr double kJoined_m = 3.5;  // a longer distance of two places was not driven over

constexpr Duration kPatience = from_seconds(4.0);  // for an obstacle
constexpr double kFreed_m = 0.5;

double distance_m(const Vec2& p, const Vec2& from, const Vec2& to) {
  const Vec2 d = to - from;
  const double t = std::clamp((p - from).dot(d) / std::max(1e-9, d.squaredNorm()), 0.0, 1.0);
  return (p - from - t * d).norm();
}

/// Point `t` of 1 between b and c.
Pose2d between(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d, double t) {
  const Vec2 linear = 0.5 * (c - a);
  const Vec2 square = a - 2.5 * b + 2.0 * c - 0.5 * d;
  const Vec2 cube = 0.5 * (d - a) + 1.5 * (b - c);
  const Vec2 p = b + t * (linear + t * (square + t * cube));
  const Vec2 first = linear + t * (2.0 * square + 3.0 * t * cube);
  const Vec2 second = 2.0 * square + 6.0 * t * cube;
  const double cross = first.x() * second.y() - first.y() * second.x();
  const double v = std::max(1e-6, first.norm());
  return {p.x(), p.y(), std::atan2(first.y(), first.x()), cross / (v * v * v)};
}

/// The vehicle has driven from place `k` to the next one, which exists.
bool joined(const std::vector<Vec2>& line, std::size_t k) {
  return k + 1 < line.size() && (line[k + 1] - line[k]).norm() <= kJoined_m;
}

/// Calls each(place, begins) every kEach_m or less along the curve, which begins again after places
/// that are not joined.
template <class Each>
void each_point(const std::vector<Vec2>& line, Each&& each) {
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    if (!joined(line, k)) continue;
    const bool begins = k == 0 || !joined(line, k - 1);
    const bool ends = !joined(line, k + 1);
    const Vec2& b = line[k];
    const Vec2& c = line[k + 1];
    // The ends are extended straight.
    const Vec2 a = begins ? Vec2(2.0 * b - c) : line[k - 1];
    const Vec2 d = ends ? Vec2(2.0 * c - b) : line[k + 2];
    const int n = std::max(1, static_cast<int>(std::ceil((c - b).norm() / kEach_m)));
    for (int s = 0; s < n; ++s) {
      each(between(a, b, c, d, static_cast<double>(s) / n), begins && s == 0);
    }
    if (ends) each(between(a, b, c, d, 1.0), false);
  }
}

}  // namespace

void mark_way_back(const std::vector<Vec2>& line, const Shape& shape, const vj::Weights& weights,
                   vj::Terrain* terrain) {
  // The vehicle stays within half of a cell of its way.
  const double free_m = 0.5 * (shape.width_m - terrain->cell_m);
  for (vj::Ground& g : terrain->ground) g.off_route_m = static_cast<float>(kFarthest_m);
  for (std::size_t k = 1; k < line.size(); ++k) {
    const bool driven = joined(line, k - 1);
    const Vec2 low = line[k].cwiseMin(line[k - 1]) - Vec2::Constant(kFarthest_m);
    const Vec2 high = line[k].cwiseMax(line[k - 1]) + Vec2::Constant(kFarthest_m);
    Cell first = terrain->cell_at(low.x(), low.y());
    Cell last = terrain->cell_at(high.x(), high.y());
    first = {std::max(first.i, terrain->first.i), std::max(first.j, terrain->first.j)};
    last = {std::min(last.i, terrain->first.i + terrain->width - 1),
            std::min(last.j, terrain->first.j + terrain->height - 1)};
    for (int j = first.j; j <= last.j; ++j) {
      for (int i = first.i; i <= last.i; ++i) {
        const Cell cell{i, j};
        vj::Ground& g = terrain->ground[terrain->index(cell)];
        const Vec2 p = terrain->cell_m * Vec2(i + 0.5, j + 0.5);
        const double off_m = distance_m(p, line[k - 1], line[k]);
        g.off_route_m = std::min(g.off_route_m, static_cast<float>(off_m));
        if (off_m > free_m || !driven) continue;
        const bool is_low =
            g.step_m >= kStep_m && g.step_m <= static_cast<float>(weights.max_step_m);
        if (g.obstacle && !is_low) continue;
        g.obstacle = false;
        g.slope_rad = std::min(g.slope_rad, static_cast<float>(weights.max_slope_rad));
      }
    }
  }
}

void follow_way_back(const std::vector<Vec2>& line, const Pose2d& vehicle, const Shape& shape,
                     double max_m, Path* path) {
  path->clear();
  double nearest_m = kOn_m;
  std::size_t nearest = 0;
  std::size_t count = 0;
  each_point(line, [&](const Pose2d& p, bool /*begins*/) {
    const double off_m = std::hypot(p.x_m - vehicle.x_m, p.y_m - vehicle.y_m);
    const double turn = std::remainder(p.heading_rad - vehicle.heading_rad, 2.0 * kPi);
    if (off_m < nearest_m && std::abs(turn) < kOn_rad) {
      nearest_m = off_m;
      nearest = count;
    }
    ++count;
  });
  if (nearest_m >= kOn_m) return;
  std::size_t k = 0;
  bool ends = false;
  each_point(line, [&](Pose2d p, bool begins) {
    if (k++ < nearest || ends) return;
    ends = begins && !path->empty();
    if (ends) return;
    const double s_m = path->empty()
                           ? 0.0
                           : path->back().s_m + std::hypot(p.x_m - path->back().place.x_m,
                                                           p.y_m - path->back().place.y_m);
    ends = s_m > max_m || std::abs(p.curvature_1pm) > kSharper * shape.max_curvature_1pm;
    if (ends) return;
    p.curvature_1pm =
        std::clamp(p.curvature_1pm, -shape.max_curvature_1pm, shape.max_curvature_1pm);
    path->push_back({p, 1, s_m, 0.0, 0.0, 0.0});
  });
  if (path->size() < 2) path->clear();
}

WayBackWatch::Along WayBackWatch::on(const Ahead& ahead, const Pose2d& vehicle, Stamp now) {
  const double moved_m = std::hypot(vehicle.x_m - left_at_.x_m, vehicle.y_m - left_at_.y_m);
  const bool free =
      ahead.to_the_end || (leaves_ ? moved_m > kFreed_m && ahead.free_m > ahead.rejoining_m
                                   : ahead.free_m > ahead.min_m);
  if (free) {
    leaves_ = false;
    keeps_ = true;
    blocked_since_ = Stamp::max();
    return Along::kFree;
  }
  if (blocked_since_ == Stamp::max()) blocked_since_ = now;
  if (!leaves_ && now - blocked_since_ > kPatience) leave(vehicle);
  keeps_ = !leaves_;
  return leaves_ ? Along::kNo : Along::kWaits;
}

void WayBackWatch::leave(const Pose2d& vehicle) {
  leaves_ = true;
  keeps_ = false;
  left_at_ = vehicle;
}

}  // namespace rcs::bg
