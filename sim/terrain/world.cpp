#include "sim/terrain/world.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "sim/base/hash.h"
#include "sim/terrain/pyramid_traversal.h"

namespace rcs::sim {
namespace {

/// The bilinear ground of one cell: z = z0 + zx * s + zy * t + zxy * s * t for s, t in [0, 1].
struct Patch {
  double z0, zx, zy, zxy;

  Patch(const Tile& tile, int i, int j)
      : z0(tile.node(i, j)),
        zx(tile.node(i + 1, j) - z0),
        zy(tile.node(i, j + 1) - z0),
        zxy(tile.node(i + 1, j + 1) - z0 - zx - zy) {}

  [[nodiscard]] double height(double s, double t) const { return z0 + zx * s + t * (zy + zxy * s); }
  /// Per metre.
  [[nodiscard]] Vec2 gradient(double s, double t) const {
    return Vec2(zx + t * zxy, zy + s * zxy) * Tile::kCellsPerMetre;
  }
};

Vec3 upward_normal(const Vec2& gradient) {
  return Vec3(-gradient.x(), -gradient.y(), 1.0).normalized();
}

// Smallest root in [0, 1] of a * u^2 + b * u + c, which is positive at 0; < 0: none.
double first_root(double a, double b, double c) {
  // The parabola stays within |a| / 4 of its chord: most rays pass well above.
  if (std::min(c, a + b + c) > 0.25 * std::abs(a)) return -1.0;
  const double d = b * b - 4.0 * a * c;
  if (d < 0.0) return -1.0;
  // q has no cancellation; the roots are q / a and c / q.
  const double q = -0.5 * (b + std::copysign(std::sqrt(d), b));
  const double r1 = q != 0.0 ? c / q : -1.0;
  const double r2 = a != 0.0 ? q / a : -1.0;
  const double low = std::min(r1, r2);
  const double high = std::max(r1, r2);
  if (low >= 0.0) return low <= 1.0 ? low : -1.0;
  return high <= 1.0 ? high : -1.0;
}

// Range at which the ray hits the ground of its current cell; < 0: none.
double meet_patch(const Patch& patch, const CellRay& ray, double range_m, double exit_m,
                  const Vec2& entry) {
  const double way = exit_m - range_m;
  // Height above the patch along the ray: a parabola.
  const double above = ray.height_at(range_m) - patch.height(entry.x(), entry.y());
  if (above <= 0.0) return range_m;
  const double slope = ray.rise() - ray.x().direction * (patch.zx + patch.zxy * entry.y()) -
                       ray.y().direction * (patch.zy + patch.zxy * entry.x());
  const double bend = -patch.zxy * ray.x().direction * ray.y().direction;
  const double share = first_root(bend * way * way, slope * way, above);
  return share < 0.0 ? -1.0 : range_m + share * way;
}

/// Hit of a ray on the ground.
struct GroundHit {
  double range_m;
  Vec2 gradient;
  bool meadow;
};

// Hit on the ground within a node of level 2.
bool meet_cells(const Tile& tile, const CellRay& ray, double range_m, int i, int j,
                GroundHit* hit) {
  for (NodeWalk<0, 2> walk(ray, range_m, i, j); walk.inside(); walk.advance()) {
    const auto place = [&](double range) {
      return Vec2(ray.place(range) - Vec2(walk.i(), walk.j()));
    };
    const int ci = walk.tile_i();
    const int cj = walk.tile_j();
    const float highest = std::max(std::max(tile.node(ci, cj), tile.node(ci + 1, cj)),
                                   std::max(tile.node(ci, cj + 1), tile.node(ci + 1, cj + 1)));
    if (ray.lowest(walk.range(), walk.exit()) > highest) continue;
    const Patch patch(tile, ci, cj);
    const double met_m = meet_patch(patch, ray, walk.range(), walk.exit(), place(walk.range()));
    if (met_m < 0.0) continue;
    const Vec2 at = place(met_m);
    hit->range_m = met_m;
    hit->gradient = patch.gradient(at.x(), at.y());
    return true;
  }
  return false;
}

// Hit on the ground within a node of the object level.
bool meet_ground(const Tile& tile, const CellRay& ray, double range_m, int i, int j,
                 GroundHit* hit) {
  for (NodeWalk<2, 2> walk(ray, range_m, i, j); walk.inside(); walk.advance()) {
    const double highest = tile.maximum[Tile::node_index(2, walk.tile_i(), walk.tile_j())];
    if (ray.lowest(walk.range(), walk.exit()) > highest) continue;
    const double from_m = std::max(walk.range(), ray.range_down_to(highest));
    if (!meet_cells(tile, ray, from_m, walk.i(), walk.j(), hit)) continue;
    const int meadow = walk.tile_j() * Tile::kMeadowSide + walk.tile_i();
    hit->meadow = tile.meadow[static_cast<std::size_t>(meadow)] > 0.0F;
    return true;
  }
  return false;
}

}  // namespace

struct World::Shot {
  const Ray& ray;
  double time_s;
  std::uint64_t id;
};

Fan::Fan(const std::vector<Ray>& rays) {
  const Ray& middle = rays[rays.size() / 2];
  origin_world = middle.origin_world.head<2>();
  axis_world = middle.direction_world.head<2>().normalized();
  lowest_m = middle.origin_world.z();
  lowest_rise = std::numeric_limits<double>::infinity();
  for (const Ray& ray : rays) {
    const Vec2 across = ray.direction_world.head<2>();
    const double length = across.norm();
    if (length < 0.1) {
      axis_world = Vec2::Zero();
      return;
    }
    const double inverse = 1.0 / length;
    spread_m = std::max(spread_m, (ray.origin_world.head<2>() - origin_world).squaredNorm());
    spread_per_m = std::max(spread_per_m, (inverse * across - axis_world).squaredNorm());
    lowest_m = std::min(lowest_m, ray.origin_world.z());
    lowest_rise = std::min(lowest_rise, inverse * ray.direction_world.z());
  }
  spread_m = std::sqrt(spread_m);
  spread_per_m = std::sqrt(spread_per_m);
}

World::World(const WorldParams& params, Dem dem, const std::vector<Vec2>& course_world,
             double reach_m)
    : relief_(mix(params.seed), params.octaves, std::move(dem), params.features, params.roads),
      scatter_(mix(params.seed + 1), params.rocks, params.vegetation, course_world, params.clear_m,
               params.roads) {
  RCS_CHECK(!course_world.empty());
  Vec2 low = course_world.front();
  Vec2 high = low;
  for (const Vec2& p : course_world) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const auto tile_of = [](double x_m) { return static_cast<int>(std::floor(x_m / Tile::kSize_m)); };
  tx0_ = tile_of(low.x() - reach_m);
  ty0_ = tile_of(low.y() - reach_m);
  tiles_x_ = tile_of(high.x() + reach_m) - tx0_ + 1;
  tiles_y_ = tile_of(high.y() + reach_m) - ty0_ + 1;
  tiles_.resize(static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y_));
}

bool World::contains(double x_m, double y_m) const {
  const double u = x_m / Tile::kSize_m - tx0_;
  const double v = y_m / Tile::kSize_m - ty0_;
  return u >= 0.0 && v >= 0.0 && u < tiles_x_ && v < tiles_y_;
}

const Tile& World::new_tile(int i, int j) const {
  std::unique_ptr<const Tile>& slot = tiles_[static_cast<std::size_t>(j * tiles_x_ + i)];
  slot = std::make_unique<const Tile>(make_tile(tx0_ + i, ty0_ + j, relief_, scatter_));
  return *slot;
}

World::Ground World::ground(double x_m, double y_m) const {
  RCS_CHECK(contains(x_m, y_m));
  const double u = x_m / Tile::kCell_m - static_cast<double>(tx0_) * Tile::kCells;
  const double v = y_m / Tile::kCell_m - static_cast<double>(ty0_) * Tile::kCells;
  const int i = static_cast<int>(u);
  const int j = static_cast<int>(v);
  const Patch patch(tile(i / Tile::kCells, j / Tile::kCells), i % Tile::kCells, j % Tile::kCells);
  return {patch.height(u - i, v - j), patch.gradient(u - i, v - j)};
}

double World::height(double x_m, double y_m) const { return ground(x_m, y_m).height_m; }

Vec3 World::normal(double x_m, double y_m) const {
  return upward_normal(ground(x_m, y_m).gradient);
}

// Maximum mipmaps (Tevs, Ihrke & Seidel 2008): the ray skips every node whose highest point it
// stays above, and descends into the others, two levels at a time; here to the object level.
bool World::cast(const Ray& ray, double max_range_m, double time_s, std::uint64_t shot_id, Hit* hit,
                 double clear_m) const {
  const CellRay cell_ray(Tile::kCellsPerMetre * ray.origin_world.x() - tx0_ * Tile::kCells,
                         Tile::kCellsPerMetre * ray.origin_world.y() - ty0_ * Tile::kCells,
                         Tile::kCellsPerMetre * ray.direction_world.head<2>(), ray.origin_world.z(),
                         ray.direction_world.z());
  const Vec2 start = cell_ray.place(clear_m);
  if (!(start.x() >= 0.0 && start.y() >= 0.0 && start.x() < tiles_x_ * Tile::kCells &&
        start.y() < tiles_y_ * Tile::kCells)) {
    return false;
  }
  const Shot shot{ray, time_s, shot_id};
  hit->range_m = max_range_m;

  constexpr int kLevel = Tile::kObjectLevel + 2;
  constexpr int kWorld = 20;  // levels up: the whole world
  for (NodeWalk<kLevel, kWorld> walk(cell_ray, clear_m, 0, 0); walk.range() < hit->range_m;
       walk.advance()) {
    const int i = walk.i() >> (Tile::kTop - kLevel);
    const int j = walk.j() >> (Tile::kTop - kLevel);
    if (i < 0 || j < 0 || i >= tiles_x_ || j >= tiles_y_) break;
    const Tile& t = tile(i, j);
    const double highest = t.maximum[Tile::node_index(kLevel, walk.tile_i(), walk.tile_j())];
    if (cell_ray.lowest(walk.range(), walk.exit()) > highest) continue;
    // Nothing can be hit above the highest point of the node.
    const double from_m = std::max(walk.range(), cell_ray.range_down_to(highest));
    if (meet_block(t, cell_ray, from_m, walk.i(), walk.j(), shot, hit)) break;
  }
  return hit->range_m < max_range_m;
}

// A node two levels above the object level. Returns whether the ray ends in the ground there.
bool World::meet_block(const Tile& t, const CellRay& cell_ray, double range_m, int i, int j,
                       const Shot& shot, Hit* hit) const {
  for (NodeWalk<Tile::kObjectLevel, 2> walk(cell_ray, range_m, i, j);
       walk.inside() && walk.range() < hit->range_m; walk.advance()) {
    const double highest =
        t.maximum[Tile::node_index(Tile::kObjectLevel, walk.tile_i(), walk.tile_j())];
    const double lowest = cell_ray.lowest(walk.range(), walk.exit());
    if (lowest > highest) continue;
    const std::size_t node = Tile::object_node(walk.tile_i(), walk.tile_j());
    meet_objects(t, node, shot, hit);
    if (lowest > t.ground_maximum[node]) continue;
    const double from_m = std::max(walk.range(), cell_ray.range_down_to(t.ground_maximum[node]));
    GroundHit ground_hit;
    if (!meet_ground(t, cell_ray, from_m, walk.i(), walk.j(), &ground_hit)) continue;
    if (ground_hit.range_m < hit->range_m) {
      hit->range_m = ground_hit.range_m;
      hit->cos_incidence =
          std::abs(upward_normal(ground_hit.gradient).dot(shot.ray.direction_world));
      if (ground_hit.meadow) meet_grass(shot, hit);
    }
    return true;
  }
  return false;
}

// Marches along the axis from node to node of the object level. A sample covers the points of the
// rays within half a step along the axis: while the fan is narrow, they are all in the surrounding
// 3 x 3 nodes.
double World::clear_distance(const Fan& fan, double max_m) const {
  constexpr double kStep_m = Tile::kCell_m * (1 << Tile::kObjectLevel);
  constexpr double kWidest_m = 0.8 * kStep_m;  // with half a step along: within one step, 0.94
  double clear_m = 0.0;
  for (int k = 0; clear_m < max_m && fan.axis_world != Vec2::Zero(); ++k) {
    const double next_m = (k + 0.5) * kStep_m;
    if (fan.spread_m + fan.spread_per_m * next_m > kWidest_m) break;
    const double way_m = fan.lowest_rise < 0.0 ? next_m : clear_m;
    if (fan.lowest_m + fan.lowest_rise * way_m <=
        highest_around(fan.origin_world + k * kStep_m * fan.axis_world)) {
      break;
    }
    clear_m = next_m;
  }
  return std::min(clear_m, max_m);
}

// Of the 3 x 3 nodes of the object level around a position; beyond the world there is no bound.
double World::highest_around(const Vec2& place_world) const {
  constexpr double kNode_m = Tile::kCell_m * (1 << Tile::kObjectLevel);
  const int i = static_cast<int>(std::floor(place_world.x() / kNode_m)) - tx0_ * Tile::kObjectSide;
  const int j = static_cast<int>(std::floor(place_world.y() / kNode_m)) - ty0_ * Tile::kObjectSide;
  if (i < 1 || j < 1 || i + 1 >= tiles_x_ * Tile::kObjectSide ||
      j + 1 >= tiles_y_ * Tile::kObjectSide) {
    return std::numeric_limits<double>::infinity();
  }
  float highest = -std::numeric_limits<float>::infinity();
  for (int b = j - 1; b <= j + 1; ++b) {
    for (int a = i - 1; a <= i + 1; ++a) {
      const Tile& t = tile(a / Tile::kObjectSide, b / Tile::kObjectSide);
      highest =
          std::max(highest, t.maximum[Tile::node_index(Tile::kObjectLevel, a % Tile::kObjectSide,
                                                       b % Tile::kObjectSide)]);
    }
  }
  return highest;
}

void World::meet_objects(const Tile& t, std::size_t node, const Shot& shot, Hit* hit) const {
  for (std::uint32_t k = t.first_object[node]; k < t.first_object[node + 1]; ++k) {
    const Spheroid& o = t.objects[t.node_objects[k]];
    // Scaled along z the spheroid is a sphere; the parameter of the ray remains the range.
    const double stretch = o.radius_m / o.half_height_m;
    // Most objects are far from the ray: their sway need not be computed.
    const Vec3 to_centre = o.centre_world - shot.ray.origin_world;
    const double reach_m = std::max(o.radius_m, o.half_height_m) + 1.5 * o.sway_m;
    if (to_centre.cross(shot.ray.direction_world).squaredNorm() > reach_m * reach_m) continue;
    const Vec3 to_origin =
        shot.ray.origin_world - o.centre_at(shot.time_s, scatter_.vegetation().sway_hz);
    const Vec3 p(to_origin.x(), to_origin.y(), to_origin.z() * stretch);
    const Vec3& direction = shot.ray.direction_world;
    const Vec3 d(direction.x(), direction.y(), direction.z() * stretch);
    const double a = d.squaredNorm();
    const double b = p.dot(d);
    const double c = p.squaredNorm() - o.radius_m * o.radius_m;
    const double discriminant = b * b - a * c;
    if (discriminant <= 0.0) continue;
    const double root = std::sqrt(discriminant);
    const double exit_m = (-b + root) / a;
    double range_m = std::max(0.0, (-b - root) / a);
    if (exit_m <= 0.0 || range_m >= hit->range_m) continue;
    double cos_incidence = 1.0;
    if (o.extinction_1pm > 0.0) {
      // Leaves are stationary apart from the sway: the draw depends on shot and object only.
      const std::uint64_t leaf = mix(shot.id ^ static_cast<std::uint64_t>(o.phase_rad * 1e9));
      range_m += -std::log(1.0 - to_unit(leaf)) / o.extinction_1pm;
      if (range_m >= exit_m || range_m >= hit->range_m) continue;
    } else {
      const Vec3 at = p + range_m * d;
      const Vec3 n = Vec3(at.x(), at.y(), at.z() * stretch).normalized();
      cos_incidence = std::abs(n.dot(direction));
    }
    hit->range_m = range_m;
    hit->cos_incidence = cos_incidence;
  }
}

void World::meet_grass(const Shot& shot, Hit* hit) const {
  const VegetationParams& veg = scatter_.vegetation();
  if (veg.grass_height_m <= 0.0) return;
  // The layer is as thick as the grass is high; grazing rays have a long path in it.
  const double way_m =
      std::min(hit->range_m, veg.grass_height_m / std::max(hit->cos_incidence, 0.02));
  const double free_m =
      std::log(1.0 - to_unit(mix(shot.id + 77))) / std::log(veg.grass_transmittance_per_m);
  if (free_m >= way_m) return;
  hit->range_m += free_m - way_m;
  hit->cos_incidence = 1.0;
}

void World::objects_near(const Vec2& place_world, double radius_m,
                         std::vector<Spheroid>* out) const {
  out->clear();
  const auto first = [](double x_m, int origin) {
    return std::max(0, static_cast<int>(std::floor(x_m / Tile::kSize_m)) - origin);
  };
  const auto last = [](double x_m, int origin, int count) {
    return std::min(count - 1, static_cast<int>(std::floor(x_m / Tile::kSize_m)) - origin);
  };
  for (int j = first(place_world.y() - radius_m, ty0_);
       j <= last(place_world.y() + radius_m, ty0_, tiles_y_); ++j) {
    for (int i = first(place_world.x() - radius_m, tx0_);
         i <= last(place_world.x() + radius_m, tx0_, tiles_x_); ++i) {
      const Vec2 corner = Tile::kSize_m * Vec2(tx0_ + i, ty0_ + j);
      for (const Spheroid& o : tile(i, j).objects) {
        // A tile also lists objects that extend into it; those belong to the tile of their centre.
        const double x_m = o.centre_world.x();
        const double y_m = o.centre_world.y();
        const bool stands_here = x_m >= corner.x() && x_m < corner.x() + Tile::kSize_m &&
                                 y_m >= corner.y() && y_m < corner.y() + Tile::kSize_m;
        const double dx = x_m - place_world.x();
        const double dy = y_m - place_world.y();
        if (stands_here && dx * dx + dy * dy <= radius_m * radius_m) out->push_back(o);
      }
    }
  }
}

void World::forget_beyond(double x_m, double y_m, double radius_m) const {
  const Vec2 place(x_m, y_m);
  std::size_t at = 0;
  for (int j = 0; j < tiles_y_; ++j) {
    for (int i = 0; i < tiles_x_; ++i, ++at) {
      const Vec2 centre = Tile::kSize_m * Vec2(tx0_ + i + 0.5, ty0_ + j + 0.5);
      if (tiles_[at] != nullptr && (centre - place).norm() > radius_m) tiles_[at].reset();
    }
  }
}

}  // namespace rcs::sim
