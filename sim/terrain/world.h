#pragma once
// The world that the vehicle drives through, and what a ray of light meets in it.

#include <cstdint>
#include <memory>
#include <vector>

#include "rcs/base/linear.h"
#include "sim/terrain/relief.h"
#include "sim/terrain/scatter.h"
#include "sim/terrain/world_tile.h"

namespace rcs::sim {

class CellRay;

struct WorldParams {
  std::uint64_t seed = 1;
  std::vector<Octave> octaves;  ///< empty and no DEM: the plane z = 0
  RockParams rocks;
  VegetationParams vegetation;
  double clear_m = 2.5;  ///< nothing stands nearer to the course
};

struct Ray {
  Vec3 origin_world;
  Vec3 direction_world;  ///< unit
};

/// Rays side by side from about the same place: what bounds them all.
struct Fan {
  /// @param rays  at least one
  explicit Fan(const std::vector<Ray>& rays);

  Vec2 origin_world;        ///< of the middle ray, seen from above
  Vec2 axis_world;          ///< unit; zero where a ray is so steep that there is no such thing
  double spread_m = 0.0;    ///< no origin is farther from the middle's
  double spread_per_m = 0;  ///< and no ray leaves the axis by more, per metre of horizontal way
  double lowest_m;          ///< lowest origin
  double lowest_rise;       ///< of a ray, per metre of horizontal way
};

struct Hit {
  double range_m = 0.0;
  double cos_incidence = 1.0;  ///< of the surface that was hit; foliage and grass: 1
};

/// Heights are in frame world. Tiles of the world are made when first looked at, and are the same
/// whatever the order; not thread-safe for that reason.
class World {
 public:
  /// @param course_world  points along the course, at most 1 m apart; never empty
  /// @param reach_m  how far from the course the world extends
  World(const WorldParams& params, Dem dem, const std::vector<Vec2>& course_world, double reach_m);

  [[nodiscard]] const Relief& relief() const { return relief_; }
  [[nodiscard]] bool contains(double x_m, double y_m) const;

  /// Bare ground; the place must be contained.
  [[nodiscard]] double height(double x_m, double y_m) const;
  /// Upward unit normal of the bare ground; the place must be contained.
  [[nodiscard]] Vec3 normal(double x_m, double y_m) const;

  /// The first thing that a ray meets.
  /// @param time_s  when: vegetation sways
  /// @param shot  decides where in foliage the light is sent back
  /// @param clear_m  nothing is met before this range, as clear_distance() says of many rays at
  /// once
  /// @return false: nothing within max_range_m, or the ray leaves the world
  [[nodiscard]] bool cast(const Ray& ray, double max_range_m, double time_s, std::uint64_t shot,
                          Hit* hit, double clear_m = 0.0) const;

  /// A horizontal distance within which no ray of the fan meets anything.
  [[nodiscard]] double clear_distance(const Fan& fan, double max_m) const;

  /// Everything that stands, with its centre within `radius_m` of a place as seen from above, in
  /// an order that depends on the place alone. Beyond the world nothing stands.
  void objects_near(const Vec2& place_world, double radius_m, std::vector<Spheroid>* out) const;

  /// Frees the tiles farther than `radius_m` from a place; they come back when looked at.
  void forget_beyond(double x_m, double y_m, double radius_m) const;

 private:
  struct Shot;
  struct Ground {
    double height_m;
    Vec2 gradient;
  };

  [[nodiscard]] Ground ground(double x_m, double y_m) const;
  [[nodiscard]] const Tile& tile(int i, int j) const {
    const std::size_t at = static_cast<std::size_t>(j * tiles_x_ + i);
    return tiles_[at] != nullptr ? *tiles_[at] : new_tile(i, j);
  }
  const Tile& new_tile(int i, int j) const;
  [[nodiscard]] double highest_around(const Vec2& place_world) const;
  bool meet_block(const Tile& tile, const CellRay& ray, double range_m, int i, int j,
                  const Shot& shot, Hit* hit) const;
  void meet_objects(const Tile& tile, std::size_t node, const Shot& shot, Hit* hit) const;
  void meet_grass(const Shot& shot, Hit* hit) const;

  Relief relief_;
  Scatter scatter_;
  int tx0_ = 0, ty0_ = 0;  ///< of the south-western tile
  int tiles_x_ = 0, tiles_y_ = 0;
  mutable std::vector<std::unique_ptr<const Tile>> tiles_;
};

}  // namespace rcs::sim
