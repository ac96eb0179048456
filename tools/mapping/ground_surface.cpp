#include "tools/mapping/ground_surface.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rcs::mapping {
namespace {

constexpr double kAbovePlane_m = 0.05;  // higher above a plane: above-ground structure
constexpr double kAboveWeight = 0.02;   // its weight in the plane
constexpr int kRounds = 6;
constexpr int kWide = 3;  // cells to each side: 3.5 m in total
constexpr int kNear = 1;
constexpr double kPit_m = 0.6;      // deeper below its neighbours: not ground
constexpr double kThrough_m = 0.3;  // a ray so far below the ground has seen through it
constexpr double kSkim_m = 1.0;     // last part of a ray, near the ground, that is ignored

}  // namespace

Cell GroundSurface::cell_at(double x_m, double y_m) const {
  return {static_cast<int>(std::floor(x_m / params_.cell_m)),
          static_cast<int>(std::floor(y_m / params_.cell_m))};
}

void GroundSurface::add(const Vec3& p) {
  std::vector<Layer>& layers = columns_.at(cell_at(p.x(), p.y())).layers;
  const auto number = static_cast<std::int32_t>(std::floor(p.z() / params_.layer_m));
  const auto at = std::lower_bound(layers.begin(), layers.end(), number,
                                   [](const Layer& l, std::int32_t n) { return l.number < n; });
  if (at != layers.end() && at->number == number) {
    ++at->returns;
    return;
  }
  layers.insert(at, {number, 1});
  ++layers_;
}

std::optional<double> GroundSurface::lowest(const Column& column) const {
  constexpr std::int32_t kThick = 3;  // layers over which a slope distributes the ground
  constexpr double kMin = 2.0;
  double all = 0.0;
  for (const Layer& l : column.layers) all += l.returns;
  const double needed = std::max(kMin, params_.support * all);
  for (std::size_t a = 0; a < column.layers.size(); ++a) {
    double returns = 0.0;
    double moment = 0.0;
    const std::int32_t bottom = column.layers[a].number;
    for (std::size_t b = a; b < column.layers.size(); ++b) {
      const Layer& l = column.layers[b];
      if (l.number >= bottom + kThick) break;
      returns += l.returns;
      moment += l.returns * (l.number + 0.5);
    }
    if (returns >= needed) return params_.layer_m * moment / returns;
  }
  return std::nullopt;
}

/// Plane through the lowest layers of neighbouring cells, by least squares.
/// @param lower  small weight of points above the plane (an expectile; Newey and Powell 1987)
std::optional<GroundSurface::Plane> GroundSurface::plane_around(Cell c, int reach,
                                                                bool lower) const {
  constexpr double kShrink = 1e-3;  // regularizes a slope from too few cells
  constexpr int kMin = 3;
  std::vector<Vec3> around;
  for (int j = c.j - reach; j <= c.j + reach; ++j) {
    for (int i = c.i - reach; i <= c.i + reach; ++i) {
      const Node* n = nodes_.find({i, j});
      if (n != nullptr && n->known) around.emplace_back(i - c.i, j - c.j, n->low_m);
    }
  }
  if (static_cast<int>(around.size()) < kMin) return std::nullopt;
  const double base_m = around.front().z();
  Vec3 plane = Vec3::Zero();
  std::vector<double> weight(around.size(), 1.0);
  for (int round = 0; round < (lower ? kRounds : 1); ++round) {
    Mat3 A = Vec3(0.0, kShrink, kShrink).asDiagonal();
    Vec3 b = Vec3::Zero();
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec3 row(1.0, around[k].x(), around[k].y());
      A += weight[k] * row * row.transpose();
      b += weight[k] * row * (around[k].z() - base_m);
    }
    plane = A.ldlt().solve(b);
    for (std::size_t k = 0; k < around.size(); ++k) {
      const double off_m =
          around[k].z() - base_m - plane.dot(Vec3(1.0, around[k].x(), around[k].y()));
      weight[k] = off_m > kAbovePlane_m ? kAboveWeight : 1.0;
    }
  }
  return Plane{base_m + plane[0], plane.tail<2>() / params_.cell_m};
}

bool GroundSurface::finish(const std::function<bool()>& going) {
  constexpr int kEvery = 1024;  // cells, in each of which a plane is fitted
  int cells = 0;
  bool ended = false;
  const auto goes_on = [&] {
    if (++cells % kEvery == 0 && !ended) ended = !going();
    return !ended;
  };
  columns_.for_each([this](Cell c, const Column& column) {
    const std::optional<double> low_m = lowest(column);
    if (!low_m) return;
    Node& n = nodes_.at(c);
    n.known = true;
    n.low_m = static_cast<float>(*low_m);
  });
  columns_ = {};
  layers_ = 0;
  // From its rim on: points behind it are farther from the ground.
  constexpr int kPeels = 3;
  for (int peel = 0; peel < kPeels; ++peel) {
    std::vector<Cell> refused;
    nodes_.for_each([&](Cell c, const Node& n) {
      if (!n.known || !goes_on()) return;
      const std::optional<Plane> plane = plane_around(c, kWide + peel, true);
      const double off_m = plane ? n.low_m - plane->z_m : 0.0;
      if (!plane || off_m > params_.stands_m || off_m < -kPit_m) refused.push_back(c);
    });
    for (const Cell c : refused) nodes_.at(c).known = false;
  }
  std::vector<std::pair<Cell, Plane>> planes;
  nodes_.for_each([&](Cell c, const Node& n) {
    if (!n.known || !goes_on()) return;
    const std::optional<Plane> near = plane_around(c, kNear, false);
    const std::optional<Plane> plane = near ? near : plane_around(c, kWide, true);
    planes.emplace_back(c, plane ? *plane : Plane{n.low_m, Vec2::Zero()});
  });
  for (const auto& [c, plane] : planes) {
    Node& n = nodes_.at(c);
    n.z_m = static_cast<float>(plane.z_m);
    n.slope_x = static_cast<float>(plane.slope.x());
    n.slope_y = static_cast<float>(plane.slope.y());
  }
  return !ended;
}

void GroundSurface::see_through(const Vec3& from, const Vec3& to, std::uint32_t scan) {
  // A return below the ground is a mirror image: its ray is ignored.
  const std::optional<GroundHere> end = at(to.x(), to.y());
  if (!end || to.z() < end->z_m - kThrough_m) return;
  const double length_m = (to - from).head<2>().norm();
  const int steps = static_cast<int>((length_m - kSkim_m) / params_.cell_m);
  for (int k = 1; k < steps; ++k) {
    const Vec3 p = from + (k * params_.cell_m / length_m) * (to - from);
    Node* n = nodes_.find(cell_at(p.x(), p.y()));
    if (n == nullptr || !n->known || p.z() > n->z_m - kThrough_m) continue;
    if (n->through > 0 && n->through_scan == scan) continue;
    n->through_scan = scan;
    if (n->through < 0xFFFFU) ++n->through;
  }
}

std::int64_t GroundSurface::close() {
  constexpr int kScans = 2;
  std::vector<Cell> seen;
  nodes_.for_each([&](Cell c, const Node& n) {
    if (n.known && n.through >= kScans) seen.push_back(c);
  });
  for (const Cell c : seen) nodes_.at(c).closed = true;
  return static_cast<std::int64_t>(seen.size());
}

std::optional<GroundHere> GroundSurface::at(double x_m, double y_m) const {
  const Node* own = nodes_.find(cell_at(x_m, y_m));
  if (own == nullptr || !own->known || own->closed) return std::nullopt;
  const double u = x_m / params_.cell_m - 0.5;
  const double v = y_m / params_.cell_m - 0.5;
  const Cell low{static_cast<int>(std::floor(u)), static_cast<int>(std::floor(v))};
  // The known planes of the four nearest cells, blended.
  double weights = 0.0;
  GroundHere here;
  for (int k = 0; k < 4; ++k) {
    const Cell c{low.i + k % 2, low.j + k / 2};
    const Node* n = nodes_.find(c);
    if (n == nullptr || !n->known) continue;
    const Vec2 off(u - c.i, v - c.j);
    const double w = (1.0 - std::abs(off.x())) * (1.0 - std::abs(off.y()));
    const Vec2 slope(n->slope_x, n->slope_y);
    weights += w;
    here.z_m += w * (n->z_m + params_.cell_m * slope.dot(off));
    here.gradient += w * slope;
  }
  here.z_m /= weights;  // the cell itself is one of them, with a weight of at least a quarter
  here.gradient /= weights;
  return here;
}

std::size_t GroundSurface::bytes() const {
  return columns_.bytes() + nodes_.bytes() + layers_ * 2 * sizeof(Layer);
}

}  // namespace rcs::mapping
