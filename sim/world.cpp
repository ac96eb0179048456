#include "sim/world.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"
#include "sim/hash.h"

namespace rcs::sim {
namespace {

// Slope of a bilinear patch along its axes, per cell.
Vec2 patch_gradient(const float* z, double s, double t) {
  const double z00 = z[0];
  const double z10 = z[1];
  const double z01 = z[Tile::kNodes];
  const double z11 = z[Tile::kNodes + 1];
  const double twist = z11 - z01 - z10 + z00;
  return {z10 - z00 + t * twist, z01 - z00 + s * twist};
}

double patch_height(const float* z, double s, double t) {
  const double south = z[0] + s * (static_cast<double>(z[1]) - z[0]);
  const double north =
      z[Tile::kNodes] + s * (static_cast<double>(z[Tile::kNodes + 1]) - z[Tile::kNodes]);
  return south + t * (north - south);
}

Vec3 upward_normal(const Vec2& gradient) {
  return Vec3(-gradient.x(), -gradient.y(), 1.0).normalized();
}

// Smallest root in [0, 1] of the parabola through (0, f0 > 0), (1/2, fm), (1, f1); < 0: none.
double first_root(double f0, double fm, double f1) {
  const double a = 2.0 * (f0 + f1) - 4.0 * fm;
  const double b = f1 - f0 - a;
  const double d = b * b - 4.0 * a * f0;
  if (d < 0.0) return -1.0;
  // q has no cancellation; the roots are q / a and f0 / q.
  const double q = -0.5 * (b + std::copysign(std::sqrt(d), b));
  const double r1 = q != 0.0 ? f0 / q : -1.0;
  const double r2 = a != 0.0 ? q / a : -1.0;
  const double low = std::min(r1, r2);
  const double high = std::max(r1, r2);
  if (low >= 0.0) return low <= 1.0 ? low : -1.0;
  return high <= 1.0 ? high : -1.0;
}

// A ray's way through the nodes of the pyramid, seen from above, in cells from the world's corner.
// Node indices are carried along as integers, so that rounding can neither skip a node nor stand
// still; the ranges of the node's far faces are carried along by sums.
class NodeWalk {
 public:
  NodeWalk(const Vec2& origin, const Vec2& direction)
      : origin_(origin),
        east_(direction.x() >= 0.0 ? 1 : 0),
        north_(direction.y() >= 0.0 ? 1 : 0),
        // A ray along an axis never reaches the faces across it.
        cell_x_(1.0 / std::max(std::abs(direction.x()), 1e-12)),
        cell_y_(1.0 / std::max(std::abs(direction.y()), 1e-12)),
        i_(static_cast<int>(origin.x()) >> kStart),
        j_(static_cast<int>(origin.y()) >> kStart) {
    enter(kStart);
  }

  [[nodiscard]] int level() const { return level_; }
  [[nodiscard]] double range() const { return range_; }  ///< where the node was entered
  [[nodiscard]] double exit() const { return std::max(range_, std::min(exit_x_, exit_y_)); }
  [[nodiscard]] int i() const { return i_; }
  [[nodiscard]] int j() const { return j_; }
  [[nodiscard]] int tile_i() const { return i_ >> (Tile::kTop - level_); }
  [[nodiscard]] int tile_j() const { return j_ >> (Tile::kTop - level_); }
  [[nodiscard]] std::size_t node_index() const {
    return Tile::node_index(level_, local(i_) << level_, local(j_) << level_);
  }
  [[nodiscard]] std::size_t object_node() const {
    return Tile::object_node(local(i_) << level_, local(j_) << level_);
  }

  /// Moves on within the node.
  void skip_to(double range) { range_ = std::max(range_, range); }

  /// To the child where the ray is.
  void descend() {
    --level_;
    descend_axis(cell_x_, east_, &i_, &exit_x_);
    descend_axis(cell_y_, north_, &j_, &exit_y_);
  }

  /// To the neighbour; a level up when it has another parent, and up to the level of the objects
  /// when it belongs to another node of that.
  void advance() {
    const int old_i = i_;
    const int old_j = j_;
    if (exit_x_ < exit_y_) {
      range_ = std::max(range_, exit_x_);
      exit_x_ += cell_x_ * (1 << level_);
      i_ += 2 * east_ - 1;
    } else {
      range_ = std::max(range_, exit_y_);
      exit_y_ += cell_y_ * (1 << level_);
      j_ += 2 * north_ - 1;
    }
    const int changed = (i_ ^ old_i) | (j_ ^ old_j);
    if (level_ < Tile::kObjectLevel && (changed >> (Tile::kObjectLevel - level_)) != 0) {
      i_ >>= Tile::kObjectLevel - level_;
      j_ >>= Tile::kObjectLevel - level_;
      enter(Tile::kObjectLevel);
    } else if (level_ < Tile::kTop && (changed >> 1) != 0) {
      ascend_axis(cell_x_, east_, &i_, &exit_x_);
      ascend_axis(cell_y_, north_, &j_, &exit_y_);
      ++level_;
    }
  }

 private:
  static constexpr int kStart = Tile::kObjectLevel;  // never above: its objects would be missed

  [[nodiscard]] int local(int node) const { return node & ((Tile::kCells >> level_) - 1); }

  // Node (i_, j_) of `level`, its far faces afresh.
  void enter(int level) {
    level_ = level;
    const double x = static_cast<double>((i_ + east_) * (1 << level)) - origin_.x();
    const double y = static_cast<double>((j_ + north_) * (1 << level)) - origin_.y();
    exit_x_ = std::abs(x) * cell_x_;
    exit_y_ = std::abs(y) * cell_y_;
  }
  void descend_axis(double cell, int forward, int* node, double* exit) const {
    const double middle = *exit - cell * (1 << level_);
    const bool first_half = range_ < middle;
    if (first_half) *exit = middle;
    *node = 2 * *node + (first_half ? 1 - forward : forward);
  }
  void ascend_axis(double cell, int forward, int* node, double* exit) const {
    const bool first_half = (*node & 1) != forward;
    if (first_half) *exit += cell * (1 << level_);
    *node >>= 1;
  }

  Vec2 origin_;
  int east_, north_;        // 1: towards larger indices
  double cell_x_, cell_y_;  // range from face to face of a cell
  int i_, j_;               // node of the level
  int level_ = 0;
  double range_ = 0.0;
  double exit_x_ = 0.0, exit_y_ = 0.0;  // ranges of the node's far faces
};

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

double World::height(double x_m, double y_m) const {
  RCS_CHECK(contains(x_m, y_m));
  const double u = x_m / Tile::kCell_m - static_cast<double>(tx0_) * Tile::kCells;
  const double v = y_m / Tile::kCell_m - static_cast<double>(ty0_) * Tile::kCells;
  const int i = static_cast<int>(u);
  const int j = static_cast<int>(v);
  const Tile& t = tile(i / Tile::kCells, j / Tile::kCells);
  return patch_height(t.corners(i % Tile::kCells, j % Tile::kCells), u - i, v - j);
}

Vec3 World::normal(double x_m, double y_m) const {
  RCS_CHECK(contains(x_m, y_m));
  const double u = x_m / Tile::kCell_m - static_cast<double>(tx0_) * Tile::kCells;
  const double v = y_m / Tile::kCell_m - static_cast<double>(ty0_) * Tile::kCells;
  const int i = static_cast<int>(u);
  const int j = static_cast<int>(v);
  const Tile& t = tile(i / Tile::kCells, j / Tile::kCells);
  const float* corners = t.corners(i % Tile::kCells, j % Tile::kCells);
  return upward_normal(patch_gradient(corners, u - i, v - j) / Tile::kCell_m);
}

// Maximum mipmaps (Tevs, Ihrke & Seidel 2008): the ray jumps over every node whose highest point it
// stays above, and descends into the others.
bool World::cast(const Ray& ray, double max_range_m, double time_s, std::uint64_t shot_id,
                 Hit* hit) const {
  if (!contains(ray.origin_world.x(), ray.origin_world.y())) return false;
  const Vec2 corner(tx0_ * Tile::kSize_m, ty0_ * Tile::kSize_m);
  const Vec2 origin = (ray.origin_world.head<2>() - corner) / Tile::kCell_m;
  const Vec2 direction = ray.direction_world.head<2>() / Tile::kCell_m;
  const double oz = ray.origin_world.z();
  const double dz = ray.direction_world.z();
  const double inverse_dz = dz < 0.0 ? 1.0 / dz : 0.0;
  const Shot shot{ray, time_s, shot_id};
  hit->range_m = max_range_m;
  bool on_ground = false;

  NodeWalk walk(origin, direction);
  const Tile* t = nullptr;
  int tile_i = -1;
  int tile_j = -1;
  while (walk.range() < hit->range_m) {
    if (walk.tile_i() != tile_i || walk.tile_j() != tile_j) {
      tile_i = walk.tile_i();
      tile_j = walk.tile_j();
      if (tile_i < 0 || tile_j < 0 || tile_i >= tiles_x_ || tile_j >= tiles_y_) break;
      t = &tile(tile_i, tile_j);
    }
    const double exit = walk.exit();
    if (walk.level() > 0) {
      const double highest = t->maximum[walk.node_index()];
      if (oz + dz * (dz < 0.0 ? exit : walk.range()) <= highest) {
        // Down to the node's highest point nothing can be met.
        if (dz < 0.0) walk.skip_to((highest - oz) * inverse_dz);
        if (walk.level() == Tile::kObjectLevel) meet_objects(*t, walk.object_node(), shot, hit);
        walk.descend();
        continue;
      }
    } else {
      const float* z = t->corners(walk.i() & (Tile::kCells - 1), walk.j() & (Tile::kCells - 1));
      const Vec2 place = origin - Vec2(walk.i(), walk.j());  // relative to the cell
      const auto above = [&](double r) {
        return oz + dz * r -
               patch_height(z, place.x() + direction.x() * r, place.y() + direction.y() * r);
      };
      const double r = walk.range();
      const double f0 = above(r);
      const double share = f0 <= 0.0 ? 0.0 : first_root(f0, above(0.5 * (r + exit)), above(exit));
      if (share >= 0.0) {
        const double range_m = r + share * (exit - r);
        if (range_m < hit->range_m) {
          const Vec2 at = place + direction * range_m;
          const Vec3 n = upward_normal(patch_gradient(z, at.x(), at.y()) / Tile::kCell_m);
          hit->range_m = range_m;
          hit->cos_incidence = std::abs(n.dot(ray.direction_world));
          on_ground = true;
        }
        break;
      }
    }
    walk.advance();
  }
  if (hit->range_m >= max_range_m) return false;
  if (on_ground) meet_grass(shot, hit);
  return true;
}

void World::meet_objects(const Tile& t, std::size_t node, const Shot& shot, Hit* hit) const {
  for (std::uint32_t k = t.first_object[node]; k < t.first_object[node + 1]; ++k) {
    const Spheroid& o = t.objects[t.node_objects[k]];
    // Scaled along z the spheroid is a sphere; the ray's parameter stays the range.
    const double stretch = o.radius_m / o.half_height_m;
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
  const Vec3 p = shot.ray.origin_world + hit->range_m * shot.ray.direction_world;
  if (!scatter_.meadow(p.x(), p.y())) return;
  // The layer is as thick as the grass is high; rays that graze have a long way in it.
  const double way_m =
      std::min(hit->range_m, veg.grass_height_m / std::max(hit->cos_incidence, 0.02));
  const double free_m =
      -std::log(1.0 - to_unit(mix(shot.id + 77))) / -std::log(veg.grass_transmittance_per_m);
  if (free_m >= way_m) return;
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
