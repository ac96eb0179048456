#pragma once
// The simulated world, and ray casting in it.

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
  std::vector<Feature> features;
  std::vector<Road> roads;
  double clear_m = 2.5;  ///< no object is placed closer to the course
  double reach_m =
      0.0;  ///< of the world around the course, beyond the range of the LADAR; 0: default
};

struct Ray {
  Vec3 origin_world;
  Vec3 direction_world;  ///< unit
};

/// Adjacent rays from about the same origin: their common bounds.
struct Fan {
  /// @param rays  at least one
  explicit Fan(const std::vector<Ray>& rays);

  Vec2 origin_world;      ///< of the middle ray, in the plane
  Vec2 axis_world;        ///< unit; zero where a ray is too steep to have one
  double spread_m = 0.0;  ///< largest distance of an origin from the middle one
  double spread_per_m =
      0;            ///< largest deviation of a ray from the axis per metre of horizontal distance
  double lowest_m;  ///< lowest origin
  double lowest_rise;  ///< smallest rise of a ray per metre of horizontal distance
};

struct Hit {
  double range_m = 0.0;
  double cos_incidence = 1.0;  ///< of the surface that was hit; foliage and grass: 1
};

/// Heights are in frame world. Tiles of the world are created on first access and do not depend on
/// the order of accesses; therefore not thread-safe.
class World {
 public:
  /// @param course_world  points along the course, at most 1 m apart; never empty
  /// @param reach_m  distance of the border of the world from the course
  World(const WorldParams& params, Dem dem, const std::vector<Vec2>& course_world, double reach_m);

  [[nodiscard]] const Relief& relief() const { return relief_; }
  [[nodiscard]] const Scatter& scatter() const { return scatter_; }
  [[nodiscard]] bool contains(double x_m, double y_m) const;

  /// Bare ground; the position must be contained.
  [[nodiscard]] double height(double x_m, double y_m) const;
  /// Upward unit normal of the bare ground; the position must be contained.
  [[nodiscard]] Vec3 normal(double x_m, double y_m) const;

  /// The first surface that a ray hits.
  /// @param time_s  time of the shot: vegetation sways
  /// @param shot  decides where foliage returns the light
  /// @param clear_m  nothing is hit before this range, as returned by clear_distance() for many
  ///   rays
  /// @return false: nothing within max_range_m, or the ray leaves the world
  [[nodiscard]] bool cast(const Ray& ray, double max_range_m, double time_s, std::uint64_t shot,
                          Hit* hit, double clear_m = 0.0) const;

  /// A horizontal distance within which no ray of the fan hits anything.
  [[nodiscard]] double clear_distance(const Fan& fan, double max_m) const;

  /// All objects with their centre within `radius_m` of a position in the plane, in an order that
  /// depends on the position only. There are no objects beyond the world.
  void objects_near(const Vec2& place_world, double radius_m, std::vector<Spheroid>* out) const;

  /// Frees the tiles farther than `radius_m` from a position; they are created again on access.
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
