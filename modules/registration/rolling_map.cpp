#include "modules/registration/rolling_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"

namespace rcs::registration {
namespace {

constexpr double kCoarseRatio = 3.0;  // an integer: a coarse voxel consists of whole fine ones
constexpr double kTile_m = 16.0;      // of the archive
// A tile returns when its centre is this near, and its voxels leave at the whole radius.
constexpr float kReturnShare = 0.75F;
constexpr float kNoWay = std::numeric_limits<float>::max();

}  // namespace

VoxelTable::VoxelTable(double voxel_m, const RollingMapParams& params, std::uint32_t first_id)
    : voxel_m_(static_cast<float>(voxel_m)),
      per_m_(1.0F / static_cast<float>(voxel_m)),
      first_id_(first_id),
      params_(params),
      index_(static_cast<std::size_t>(params.capacity)),
      keep_radius_m_(static_cast<float>(params.radius_m)),
      archive_(std::max(1, static_cast<int>(std::lround(kTile_m / voxel_m))),
               static_cast<std::size_t>(params.archive)) {
  const auto capacity = static_cast<std::size_t>(params.capacity);
  voxels_.reserve(capacity);
  fits_.reserve(capacity);
  free_.reserve(capacity);
}

void VoxelTable::clear() {
  index_.clear();
  voxels_.clear();
  fits_.clear();
  free_.clear();
  archive_.clear();
  used_ = 0;
  sweep_ = 0;
  oldest_m_ = way_m_;
  oldest_of_sweep_m_ = kNoWay;
}

std::uint32_t VoxelTable::find_or_add(int i, int j, int k) {
  const bool has_room = used_ < static_cast<std::size_t>(params_.capacity);
  const bool reuses = !free_.empty();
  const std::uint32_t fresh = !has_room ? VoxelIndex::kNone
                              : reuses  ? free_.back()
                                        : static_cast<std::uint32_t>(voxels_.size());
  const std::uint32_t number = index_.find_or_add(pack_voxel(i, j, k), fresh);
  if (number != fresh || !has_room) return number;
  if (reuses) {
    free_.pop_back();
  } else {
    voxels_.emplace_back();
    fits_.emplace_back();
  }
  voxels_[number] = Voxel{i, j, k, {}, static_cast<float>(params_.min_points), way_m_};
  fits_[number] = Fit{false, false, {}};
  ++used_;
  return number;
}

void VoxelTable::forget_far(const Vec3f& centre, float way_m) {
  way_m_ = way_m;
  // A full table shrinks the radius: the farthest voxels are removed first. It grows again when
  // there is room.
  const auto capacity = static_cast<float>(params_.capacity);
  if (static_cast<float>(used_) > 0.9F * capacity) {
    keep_radius_m_ *= 0.95F;
  } else if (static_cast<float>(used_) < 0.7F * capacity) {
    keep_radius_m_ = std::min(keep_radius_m_ * 1.02F, static_cast<float>(params_.radius_m));
  }
  constexpr std::size_t kCallsPerSweep = 16;
  const float limit2 = keep_radius_m_ * keep_radius_m_;
  for (std::size_t n = voxels_.size() / kCallsPerSweep + 1; n > 0 && !voxels_.empty(); --n) {
    if (sweep_ >= voxels_.size()) {
      sweep_ = 0;
      oldest_m_ = oldest_of_sweep_m_;
      oldest_of_sweep_m_ = kNoWay;
    }
    Voxel& v = voxels_[sweep_];
    const bool used = v.moments.count > 0.0F;
    if (used) oldest_of_sweep_m_ = std::min(oldest_of_sweep_m_, v.since_m);
    if (used && (corner(v) - centre).squaredNorm() > limit2) {
      archive_.put(v, way_m);
      index_.erase(pack_voxel(v.i, v.j, v.k));
      v.moments.count = 0.0F;
      free_.push_back(static_cast<std::uint32_t>(sweep_));
      --used_;
    }
    ++sweep_;
  }
}

void VoxelTable::restore(const Vec3f& centre) {
  const std::uint32_t tile =
      archive_.nearest(fast_floor(centre.x() * per_m_), fast_floor(centre.y() * per_m_),
                       static_cast<int>(kReturnShare * keep_radius_m_ * per_m_), oldest_m_);
  if (tile == MapArchive::kNone) return;
  archive_.take(tile, [this](const Voxel& back) {
    const std::uint32_t number = find_or_add(back.i, back.j, back.k);
    if (number == VoxelIndex::kNone) return;
    Voxel& here = voxels_[number];
    Moments both = back.moments;
    if (here.moments.count > 0.0F) both.add(here.moments, Vec3f::Zero());
    here.moments = both;
    here.since_m = std::min(here.since_m, back.since_m);
    oldest_m_ = std::min(oldest_m_, back.since_m);
    oldest_of_sweep_m_ = std::min(oldest_of_sweep_m_, back.since_m);
    here.fit_again_at = static_cast<float>(params_.min_points);
    note_points(here);
  });
}

void VoxelTable::insert(const Points& points) {
  constexpr std::size_t kBlock = 32;  // as in nearest_surfaces
  const auto max_points = static_cast<float>(params_.max_points);
  struct Cell {
    int i, j, k;
  };
  std::array<Cell, kBlock> cells;
  std::array<std::uint32_t, kBlock> numbers;
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const std::size_t m = std::min(kBlock, points.size() - first);
    for (std::size_t n = 0; n < m; ++n) {
      const Vec3f p = points[first + n] * per_m_;
      cells[n] = {fast_floor(p.x()), fast_floor(p.y()), fast_floor(p.z())};
      index_.prefetch(pack_voxel(cells[n].i, cells[n].j, cells[n].k));
    }
    for (std::size_t n = 0; n < m; ++n) {
      const Cell& c = cells[n];
      numbers[n] = find_or_add(c.i, c.j, c.k);
      if (numbers[n] != VoxelIndex::kNone) __builtin_prefetch(&voxels_[numbers[n]], 1);
    }
    for (std::size_t n = 0; n < m; ++n) {
      if (numbers[n] == VoxelIndex::kNone) continue;
      Voxel& voxel = voxels_[numbers[n]];
      if (voxel.moments.count >= max_points) continue;
      voxel.moments.add(points[first + n] - corner(voxel));
      note_points(voxel);
    }
  }
}

// Refitting at each new point would cost more than it gains.
void VoxelTable::note_points(const Voxel& voxel) {
  if (voxel.moments.count >= voxel.fit_again_at) {
    fits_[static_cast<std::size_t>(&voxel - voxels_.data())].is_old = true;
  }
}

void VoxelTable::insert(const VoxelTable& finer) {
  finer.for_each([this](const Moments& moments, const Vec3f& origin) {
    const Vec3f p = (moments.mean + origin) * per_m_;
    const std::uint32_t number =
        find_or_add(fast_floor(p.x()), fast_floor(p.y()), fast_floor(p.z()));
    if (number == VoxelIndex::kNone) return;
    voxels_[number].moments.add(moments, origin - corner(voxels_[number]));
    note_points(voxels_[number]);
  });
}

void VoxelTable::fit(std::uint32_t number) {
  constexpr float kMorePoints = 1.1F;
  Voxel& v = voxels_[number];
  Fit& f = fits_[number];
  v.fit_again_at = kMorePoints * v.moments.count;
  f.is_old = false;
  f.is_surface = false;
  Eigen::SelfAdjointEigenSolver<Mat3f> eigen;
  eigen.computeDirect(v.moments.covariance());
  const Vec3f lambda = eigen.eigenvalues().cwiseMax(0.0F);
  const auto thickness = static_cast<float>(params_.max_thickness);
  const float extent = static_cast<float>(params_.min_extent) * voxel_m_;
  if (lambda[1] < extent * extent || lambda[0] > thickness * thickness * lambda[1]) return;
  f.is_surface = true;
  f.surface.mean = corner(v) + v.moments.mean;
  f.surface.normal = eigen.eigenvectors().col(0);
  f.surface.variance_m2 = lambda[0];
  // Of a plane fitted to n points of that extent.
  f.surface.angle_variance = lambda[0] / (v.moments.count * lambda[1]);
  f.surface.count = v.moments.count;
  f.surface.voxel = first_id_ + number;
}

std::array<VoxelKey, 4> VoxelTable::voxels_around(const Vec3f& p) const {
  const Vec3f s = p * per_m_;
  const int i = fast_floor(s.x());
  const int j = fast_floor(s.y());
  const int k = fast_floor(s.z());
  const int di = s.x() - static_cast<float>(i) < 0.5F ? -1 : 1;
  const int dj = s.y() - static_cast<float>(j) < 0.5F ? -1 : 1;
  const int dk = s.z() - static_cast<float>(k) < 0.5F ? -1 : 1;
  return {pack_voxel(i, j, k), pack_voxel(i + di, j, k), pack_voxel(i, j + dj, k),
          pack_voxel(i, j, k + dk)};
}

void VoxelTable::nearest_surfaces(SurfaceQuery* queries, std::size_t n) {
  constexpr std::size_t kBlock = 32;  // what the processor loads for them fits into its first cache
  std::array<std::array<VoxelKey, 4>, kBlock> keys;
  std::array<std::array<std::uint32_t, 4>, kBlock> numbers;
  while (n > 0) {
    const std::size_t m = std::min(n, kBlock);
    for (std::size_t q = 0; q < m; ++q) {
      if (queries[q].found) continue;
      keys[q] = voxels_around(queries[q].p);
      for (const VoxelKey key : keys[q]) index_.prefetch(key);
    }
    for (std::size_t q = 0; q < m; ++q) {
      if (queries[q].found) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        numbers[q][c] = index_.find(keys[q][c]);
        if (numbers[q][c] != VoxelIndex::kNone) __builtin_prefetch(&fits_[numbers[q][c]]);
      }
    }
    for (std::size_t q = 0; q < m; ++q) {
      if (queries[q].found) continue;
      const Surface* best = nullptr;
      float best2 = 0.0F;
      for (const std::uint32_t number : numbers[q]) {
        if (number == VoxelIndex::kNone) continue;
        Fit& f = fits_[number];
        if (f.is_old) fit(number);
        if (!f.is_surface) continue;
        const float d2 = (f.surface.mean - queries[q].p).squaredNorm();
        if (best == nullptr || d2 < best2) {
          best = &f.surface;
          best2 = d2;
        }
      }
      if (best == nullptr) continue;
      queries[q].found = true;
      queries[q].surface = *best;
    }
    queries += m;
    n -= m;
  }
}

RollingMap::RollingMap(const RollingMapParams& params)
    : fine_(params.voxel_m, params),
      coarse_(kCoarseRatio * params.voxel_m, params, static_cast<std::uint32_t>(params.capacity)),
      voxel_ids_(2 * static_cast<std::size_t>(params.capacity)),
      archives_(params.archive > 0) {}

void RollingMap::clear() {
  way_.clear();
  fine_.clear();
  coarse_.clear();
}

void RollingMap::insert(const Points& points_vehicle, const Pose& T_rolling_vehicle) {
  const Mat3f R = T_rolling_vehicle.rotation().cast<float>();
  const Vec3f t = T_rolling_vehicle.p.cast<float>();
  points_rolling_.resize(points_vehicle.size());
  for (std::size_t i = 0; i < points_vehicle.size(); ++i) {
    const Vec3f p = R * points_vehicle[i] + t;
    points_rolling_.x[i] = p.x();
    points_rolling_.y[i] = p.y();
    points_rolling_.z[i] = p.z();
  }
  way_.drive_to(t);
  fine_.forget_far(t, way_.length_m());
  coarse_.forget_far(t, way_.length_m());
  if (archives_ && way_.leads_back()) {
    fine_.restore(t);
    coarse_.restore(t);
  }
  const bool first = fine_.size() == 0;
  fine_.insert(points_rolling_);
  if (first) {
    coarse_.insert(fine_);
  } else {
    coarse_.insert(points_rolling_);
  }
}

bool RollingMap::nearest_surface(const Vec3f& p_rolling, Surface* out) {
  SurfaceQuery query{p_rolling};
  nearest_surfaces(&query, 1);
  *out = query.surface;
  return query.found;
}

void RollingMap::nearest_surfaces(SurfaceQuery* queries, std::size_t n) {
  for (std::size_t q = 0; q < n; ++q) queries[q].found = false;
  fine_.nearest_surfaces(queries, n);
  coarse_.nearest_surfaces(queries, n);
}

}  // namespace rcs::registration
