#pragma once
// The rolling map, against which scans are registered: surface statistics by voxel, of fixed
// memory, moving with the vehicle.

#include <array>
#include <cstdint>
#include <vector>

#include "modules/registration/driven_way.h"
#include "modules/registration/map_archive.h"
#include "modules/registration/point_moments.h"
#include "modules/registration/voxel_index.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

struct RollingMapParams {
  double voxel_m = 0.5;    ///< edge of the fine voxels; coarse ones are 3 x as large
  int capacity = 200'000;  ///< voxels of each size; the farthest are removed first
  double radius_m = 80.0;  ///< beyond this the map is removed
  int archive = 0;         ///< removed voxels of each size that are kept for the way back, newest
  int max_points = 100;    ///< a voxel with this many is complete and not updated, so that later
                           ///< errors do not shift it
  int min_points = 8;      ///< with fewer there is no surface
  double max_thickness = 0.2;  ///< of a surface: smallest over middle standard deviation
  double min_extent = 0.2;     ///< middle standard deviation over the voxel's edge (a scan line is
                               ///< not a surface)
};

/// A patch of surface to which a point can be matched.
struct Surface {
  Vec3f mean;            ///< [m], rolling frame
  Vec3f normal;          ///< unit, rolling frame
  float variance_m2;     ///< across the surface: thickness and roughness
  float angle_variance;  ///< of the normal about each axis in the surface [rad^2]
  float count;           ///< of its points
  std::uint32_t voxel;   ///< identifies the patch until the map changes
};

/// A point whose surface is looked for.
struct SurfaceQuery {
  Vec3f p;  ///< [m], rolling frame
  bool found = false;
  Surface surface{};  ///< if found
};

/// Voxels of one size: the moments of the points in each, and the surface fitted to them.
class VoxelTable {
 public:
  /// @param first_id  Surface::voxel of its first voxel
  VoxelTable(double voxel_m, const RollingMapParams& params, std::uint32_t first_id = 0);

  void insert(const Points& points_rolling);
  /// As if its points were inserted one by one. A voxel of `finer` must lie in one of this table's.
  void insert(const VoxelTable& finer);
  /// Archives voxels farther than the radius from `centre`; a part of the table at each call, so
  /// that the cost of a cycle is bounded.
  /// @param way_m  distance driven so far, also of the voxels that are inserted next
  void forget_far(const Vec3f& centre, float way_m);
  /// Puts a tile of the archive near `centre` back, if it was in the map together with what is in
  /// it now. A voxel that was seen again meanwhile gets the points of both.
  void restore(const Vec3f& centre);
  void clear();

  /// Of each query without answer: the nearest valid surface in the voxel of its point and the
  /// three voxels closest to it. Many at once, because their memory accesses then overlap.
  void nearest_surfaces(SurfaceQuery* queries, std::size_t n);

  [[nodiscard]] std::size_t size() const { return used_; }
  [[nodiscard]] std::size_t archived() const { return archive_.size(); }
  [[nodiscard]] bool full() const { return used_ >= static_cast<std::size_t>(params_.capacity); }
  [[nodiscard]] float voxel_m() const { return voxel_m_; }
  /// Calls `visit` with (moments, their frame's origin) of every voxel.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const Voxel& v : voxels_) {
      if (v.moments.count > 0.0F) visit(v.moments, corner(v));
    }
  }

 private:
  // All fields of a voxel that a search reads, in one cache line.
  struct alignas(64) Fit {
    bool is_old = true;  // to be fitted before it is used
    bool is_surface = false;
    Surface surface{};
  };

  /// Number of the voxel; VoxelIndex::kNone: the table is full.
  std::uint32_t find_or_add(int i, int j, int k);
  void note_points(const Voxel& voxel);
  void fit(std::uint32_t number);
  [[nodiscard]] std::array<VoxelKey, 4> voxels_around(const Vec3f& p) const;
  [[nodiscard]] Vec3f corner(const Voxel& v) const {
    return voxel_m_ *
           Vec3f(static_cast<float>(v.i), static_cast<float>(v.j), static_cast<float>(v.k));
  }

  float voxel_m_;
  float per_m_;
  std::uint32_t first_id_;
  RollingMapParams params_;
  VoxelIndex index_;
  std::vector<Voxel> voxels_;
  std::vector<Fit> fits_;
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;
  std::size_t sweep_ = 0;
  float keep_radius_m_;
  MapArchive archive_;
  float way_m_ = 0.0F;
  float oldest_m_ = 0.0F;           // Voxel::since_m of the oldest in the table
  float oldest_of_sweep_m_ = 0.0F;  // in the part that this sweep has passed
};

/// Two voxel sizes: fine where the map is dense, coarse where scans are sparse. With an archive, a
/// vehicle that drives back on its own way finds the map that it made on the way out: its position
/// relative to that way does not drift.
class RollingMap {
 public:
  explicit RollingMap(const RollingMapParams& params);

  /// @param points_vehicle  a deskewed scan
  void insert(const Points& points_vehicle, const Pose& T_rolling_vehicle);
  void reserve(std::size_t points) { points_rolling_.reserve(points); }
  void clear();

  /// The fine surface at `p_rolling` if there is one, else the coarse one.
  [[nodiscard]] bool nearest_surface(const Vec3f& p_rolling, Surface* out);
  /// Likewise of many points; faster.
  void nearest_surfaces(SurfaceQuery* queries, std::size_t n);

  [[nodiscard]] std::size_t size() const { return fine_.size() + coarse_.size(); }
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// Points may have been dropped for lack of room.
  [[nodiscard]] bool full() const { return fine_.full() || coarse_.full(); }
  /// One more than the largest Surface::voxel.
  [[nodiscard]] std::size_t voxel_ids() const { return voxel_ids_; }
  [[nodiscard]] const VoxelTable& coarse() const { return coarse_; }
  [[nodiscard]] std::size_t archived() const { return fine_.archived() + coarse_.archived(); }

 private:
  VoxelTable fine_;
  VoxelTable coarse_;
  std::size_t voxel_ids_;
  bool archives_;
  DrivenWay way_;
  Points points_rolling_;
};

}  // namespace rcs::registration
