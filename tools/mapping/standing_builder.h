#pragma once
// Surface points of what stands on the ground and stays, from a LADAR's returns, scan by scan.

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
  double above_m = 0.5;        ///< of the ground; what is lower is the ground's, or grass
  double voxel_m = 0.1;        ///< edge of the cubes that returns are averaged in
  double wide_m = 0.25;        ///< a surface is fitted to what is so near in the plane
  double tall_m = 0.5;         ///< and in height: trunks and walls are upright
  int least_scans = 8;         ///< from the first to the last that saw it
  double least_way_m = 1.0;    ///< between the places that it was seen from
  int least_returns = 15;      ///< of it
  double most_thick_m = 0.08;  ///< standard deviation across it: foliage has more
  double thin_m = 0.2;         ///< one point a cube so large is kept
};

/// Returns are averaged by cube; a cube that several scans saw from places apart has a surface
/// where those around it lie in a thin layer. Memory grows by the surface that was seen.
class StandingBuilder {
 public:
  explicit StandingBuilder(const StandingParams& params) : params_(params) {}

  /// A return of what stands on the ground. Frame: the map's.
  /// @param from  where the LADAR was
  /// @param scan  its number, ascending
  void add(const Vec3& p, const Vec3& from, std::uint32_t scan);
  /// After the last return.
  /// @param passing  whether what stood at (x, y) went away
  void finish(const std::function<bool(double, double)>& passing);

  [[nodiscard]] std::size_t bytes() const;
  /// Those of a tile, at most kMostSurfacePoints. Deterministic.
  /// @param level  whose origin is 0
  [[nodiscard]] std::vector<SurfacePoint> points(const MapLevel& level, Cell tile) const;

 private:
  struct Voxel {
    Vec3f sum_m = Vec3f::Zero();    // from its corner
    Vec3f towards = Vec3f::Zero();  // the LADAR: sum of unit vectors
    Vec3f first_from_m = Vec3f::Zero();
    float way_m = 0.0F;  // to the farthest place that it was seen from
    std::uint32_t returns = 0;
    std::uint32_t first_scan = 0;
    std::uint32_t scan = 0;
  };
  struct Found {
    Vec3 p_m;
    Vec3f normal;
    float sigma_m;
  };
  using Place = std::array<int, 3>;
  [[nodiscard]] static std::uint64_t key_of(const Place& at);
  [[nodiscard]] Vec3 mean(const Place& at, const Voxel& v) const;
  /// @return whether there is a surface
  [[nodiscard]] bool fit(const Place& at, const Voxel& v, Found* out) const;

  StandingParams params_;
  std::unordered_map<std::uint64_t, Voxel> voxels_;
  std::vector<Found> found_;  // in the order of their places
};

}  // namespace rcs::mapping
