#pragma once
// Extracts surface points of static above-ground structure from LADAR returns, scan by scan.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "rcs/terrain/raster.h"
#include "rcs/terrain/surface_points.h"

namespace rcs::mapping {

struct StandingParams {
  double above_m = 0.5;          ///< min height above the ground; lower returns are ground or grass
  double voxel_m = 0.1;          ///< edge of the cubes that returns are averaged in
  double wide_m = 0.25;          ///< horizontal radius of the points to which a surface is fitted
  double tall_m = 0.5;           ///< vertical radius: trunks and walls are upright
  int min_scans = 8;             ///< from the first to the last observation
  double min_travelled_m = 1.0;  ///< distance between the positions of the observations
  int min_returns = 15;          ///< of a surface
  double max_thick_m = 0.08;     ///< standard deviation across the surface: foliage has more
  double thin_m = 0.2;           ///< edge of the cubes in which one point is kept
};

/// Returns are averaged by cube. A cube that several scans observed from different positions has a
/// surface if its neighbours form a thin layer. Memory is proportional to the observed surface.
class StandingBuilder {
 public:
  explicit StandingBuilder(const StandingParams& params) : params_(params) {}

  /// Adds a return of above-ground structure in the frame of the map.
  /// @param from  position of the LADAR
  /// @param scan  number of the scan, ascending
  void add(const Vec3& p, const Vec3& from, std::uint32_t scan);
  /// Call it after the last return.
  /// @param transient  whether the structure at (x, y) is transient
  void finish(const std::function<bool(double, double)>& transient);

  [[nodiscard]] std::size_t bytes() const;
  /// Surface points of a tile, at most kMaxSurfacePoints. Deterministic.
  /// @param level  with origin 0
  [[nodiscard]] std::vector<SurfacePoint> points(const MapLevel& level, Cell tile) const;

 private:
  struct Voxel {
    Vec3f sum_m = Vec3f::Zero();    // from its corner
    Vec3f towards = Vec3f::Zero();  // the LADAR: sum of unit vectors
    Vec3f first_from_m = Vec3f::Zero();
    float way_m = 0.0F;  // distance between the farthest positions of observation
    std::uint32_t returns = 0;
    std::uint32_t first_scan = 0;
    std::uint32_t scan = 0;
  };
  struct Found {
    Vec3 p_m;
    Vec3f normal;
    float sigma_m;
  };
  using VoxelIndex = std::array<int, 3>;
  [[nodiscard]] static std::uint64_t key_of(const VoxelIndex& at);
  [[nodiscard]] Vec3 mean(const VoxelIndex& at, const Voxel& v) const;
  /// @return whether there is a surface
  [[nodiscard]] bool fit(const VoxelIndex& at, const Voxel& v, Found* out) const;

  StandingParams params_;
  std::unordered_map<std::uint64_t, Voxel> voxels_;
  std::vector<Found> found_;  // sorted by position
};

}  // namespace rcs::mapping
