#include "sim/world.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"
#include "sim/hash.h"
#include "sim/node_walk.h"

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
    return Vec2(zx + t * zxy, zy + s * zxy) / Tile::kCell_m;
  }
};

Vec3 upward_normal(const Vec2& gradient) {
  return Vec3(-gradient.x(), -gradient.y(), 1.0).normalized();
}

// Smallest root in [0, 1] of a * u^2 + b * u + c, which is positive at 0; < 0: none.
double first_root(double a, double b, double c) {
  // The parabola stays within |a| / 4 of its chord: most patches are passed well above.
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

// Where the ray meets the ground of the cell that it is in; < 0: nowhere.
double meet_patch(const Patch& patch, const CellRay& ray, const NodeWalk& walk) {
  const double way = walk.exit() - walk.range();
  const Vec2 entry = walk.place_in_cell(ray);
  // Height above the patch on the way through it: a parabola.
  const double above = ray.height_at(walk.range()) - patch.height(entry.x(), entry.y());
  if (above <= 0.0) return walk.range();
  const double slope = ray.dz - ray.direction.x() * (patch.zx + patch.zxy * entry.y()) -
                       ray.direction.y() * (patch.zy + patch.zxy * entry.x());
  const double bend = -patch.zxy * ray.direction.x() * ray.direction.y();
  const double share = first_root(bend * way * way, slope * way, above);
  return share < 0.0 ? -1.0 : walk.range() + share * way;
}

// A ray that was hardly above its node will not be above the neighbour's parent, which is twice as
// wide and higher: ascending would be in vain. A matter of speed alone.
bool worth_ascending(double margin_m, int level) {
  constexpr double kRelief = 0.2;  // of the ground, per metre
  return margin_m > kRelief * Tile::kCell_m * (1 << level);
}

/// Where a ray met the ground.
struct GroundHit {
  double range_m;
  Vec2 gradient;
};

// The ground below one node of the objects' level; `walk` is a copy that stays inside it.
bool meet_ground(const Tile& tile, const CellRay& ray, NodeWalk walk, GroundHit* hit) {
  walk.descend();
  while (true) {
    double margin_m = 0.0;
    if (walk.level() > 0) {
      const double highest = tile.maximum[Tile::node_index(walk.level(), walk.i(), walk.j())];
      margin_m = ray.lowest(walk.range(), walk.exit()) - highest;
      if (margin_m <= 0.0) {
        walk.skip_to(ray.range_down_to(highest));
        walk.descend();
        continue;
      }
    } else {
      const Patch patch(tile, walk.i(), walk.j());
      const double range_m = meet_patch(patch, ray, walk);
      if (range_m >= 0.0) {
        walk.skip_to(range_m);
        const Vec2 at = walk.place_in_cell(ray);
        *hit = {range_m, patch.gradient(at.x(), at.y())};
        return true;
      }
    }
    const int level = walk.level();
    const int changed = walk.advance();
    if ((changed >> (Tile::kObjectLevel - level)) != 0) return false;
    if ((changed >> 1) != 0 && worth_ascending(margin_m, level)) walk.ascend();
  }
}

}  // namespace

struct World::Shot {
  const Ray& ray;
  double time_s;
  std::uint64_t id;
};

World::World(const WorldParams& params, Dem dem, const std::vector<Vec2>& course_world,
             double reach_m)
    : relief_(mix(params.seed), params.octaves, std::move(dem)),
      scatter_(mix(params.seed + 1), params.rocks, params.vegetation, course_world,
               params.clear_m) {
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

const Tile& World::tile(int i, int j) const {
  std::unique_ptr<const Tile>& slot =
      tiles_[static_cast<std::size_t>(j) * static_cast<std::size_t>(tiles_x_) +
             static_cast<std::size_t>(i)];
  if (slot == nullptr) {
    slot = std::make_unique<const Tile>(make_tile(tx0_ + i, ty0_ + j, relief_, scatter_));
  }
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

// Maximum mipmaps (Tevs, Ihrke & Seidel 2008): the ray jumps over every node whose highest point it
// stays above, and descends into the others. Here from the objects' level up, in meet_ground()
// below.
bool World::cast(const Ray& ray, double max_range_m, double time_s, std::uint64_t shot_id,
                 Hit* hit) const {
  if (!contains(ray.origin_world.x(), ray.origin_world.y())) return false;
  const Vec2 corner(tx0_ * Tile::kSize_m, ty0_ * Tile::kSize_m);
  const CellRay cell_ray((ray.origin_world.head<2>() - corner) / Tile::kCell_m,
                         ray.direction_world.head<2>() / Tile::kCell_m, ray.origin_world.z(),
                         ray.direction_world.z());
  const Shot shot{ray, time_s, shot_id};
  hit->range_m = max_range_m;

  NodeWalk walk(cell_ray, Tile::kObjectLevel);
  const Tile* t = &tile(walk.tile_i(), walk.tile_j());
  while (walk.range() < hit->range_m) {
    const int level = walk.level();
    const double highest = t->maximum[Tile::node_index(level, walk.i(), walk.j())];
    const double margin_m = cell_ray.lowest(walk.range(), walk.exit()) - highest;
    if (margin_m <= 0.0) {
      // Down to the node's highest point nothing can be met.
      walk.skip_to(cell_ray.range_down_to(highest));
      if (level > Tile::kObjectLevel) {
        walk.descend();
        continue;
      }
      meet_objects(*t, Tile::object_node(walk.i(), walk.j()), shot, hit);
      GroundHit ground_hit;
      if (meet_ground(*t, cell_ray, walk, &ground_hit)) {
        if (ground_hit.range_m < hit->range_m) {
          hit->range_m = ground_hit.range_m;
          hit->cos_incidence =
              std::abs(upward_normal(ground_hit.gradient).dot(ray.direction_world));
          meet_grass(shot, hit);
        }
        break;
      }
    }
    const int changed = walk.advance();
    if ((changed >> (Tile::kTop - level)) != 0) {
      const int i = walk.tile_i();
      const int j = walk.tile_j();
      if (i < 0 || j < 0 || i >= tiles_x_ || j >= tiles_y_) break;
      t = &tile(i, j);
    }
    if (level < Tile::kTop && (changed >> 1) != 0 && worth_ascending(margin_m, level)) {
      walk.ascend();
    }
  }
  return hit->range_m < max_range_m;
}

void World::meet_objects(const Tile& t, std::size_t node, const Shot& shot, Hit* hit) const {
  for (std::uint32_t k = t.first_object[node]; k < t.first_object[node + 1]; ++k) {
    const Spheroid& o = t.objects[t.node_objects[k]];
    // Scaled along z the spheroid is a sphere; the ray's parameter stays the range.
    const double stretch = o.radius_m / o.half_height_m;
    // Most are passed by far: no need to know where the wind has them.
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
      // Leaves stay where they are while the wind allows: the draw belongs to shot and object.
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
  // The layer is as thick as the grass is high; rays that graze have a long way in it.
  const double way_m =
      std::min(hit->range_m, veg.grass_height_m / std::max(hit->cos_incidence, 0.02));
  const double free_m =
      std::log(1.0 - to_unit(mix(shot.id + 77))) / std::log(veg.grass_transmittance_per_m);
  if (free_m >= way_m) return;
  const Vec3 p = shot.ray.origin_world + hit->range_m * shot.ray.direction_world;
  if (!scatter_.meadow(p.x(), p.y())) return;
  hit->range_m += free_m - way_m;
  hit->cos_incidence = 1.0;
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
