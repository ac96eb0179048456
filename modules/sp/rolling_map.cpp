#include "modules/sp/rolling_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

std::size_t table_size(int capacity) {
  std::size_t size = 1024;
  while (size < 2 * static_cast<std::size_t>(capacity)) size *= 2;  // load at most one half
  return size;
}

constexpr double kCoarseRatio = 3.0;

}  // namespace

VoxelTable::VoxelTable(double voxel_m, const RollingMapParams& params)
    : voxel_m_(static_cast<float>(voxel_m)),
      per_m_(1.0F / static_cast<float>(voxel_m)),
      params_(params),
      table_(table_size(params.capacity)),
      mask_(table_.size() - 1),
      keep_radius_m_(static_cast<float>(params.radius_m)) {}

void VoxelTable::clear() {
  std::fill(table_.begin(), table_.end(), Voxel{});
  used_ = 0;
  sweep_ = 0;
}

VoxelTable::Voxel* VoxelTable::find(VoxelKey key) {
  for (std::size_t slot = hash_voxel(key) & mask_;; slot = (slot + 1) & mask_) {
    Voxel& v = table_[slot];
    if (v.key == key) return &v;
    if (v.key == kEmpty) return nullptr;
  }
}

VoxelTable::Voxel* VoxelTable::find_or_add(int i, int j, int k) {
  const VoxelKey key = pack_voxel(i, j, k);
  for (std::size_t slot = hash_voxel(key) & mask_;; slot = (slot + 1) & mask_) {
    Voxel& v = table_[slot];
    if (v.key == key) return &v;
    if (v.key == kEmpty) {
      if (used_ >= static_cast<std::size_t>(params_.capacity)) return nullptr;
      v = Voxel{};
      v.key = key;
      v.i = i;
      v.j = j;
      v.k = k;
      ++used_;
      return &v;
    }
  }
}

// Backward-shift deletion: no tombstones, so that the table does not age.
void VoxelTable::erase(std::size_t slot) {
  --used_;
  std::size_t hole = slot;
  for (std::size_t next = (slot + 1) & mask_; table_[next].key != kEmpty;
       next = (next + 1) & mask_) {
    const std::size_t home = hash_voxel(table_[next].key) & mask_;
    if (((next - home) & mask_) >= ((next - hole) & mask_)) {
      table_[hole] = table_[next];
      hole = next;
    }
  }
  table_[hole].key = kEmpty;
}

void VoxelTable::forget_far(const Vec3f& centre) {
  // A full table shrinks the radius: the farthest go first. It grows back when there is room.
  const auto capacity = static_cast<float>(params_.capacity);
  if (static_cast<float>(used_) > 0.9F * capacity) {
    keep_radius_m_ *= 0.95F;
  } else if (static_cast<float>(used_) < 0.7F * capacity) {
    keep_radius_m_ = std::min(keep_radius_m_ * 1.02F, static_cast<float>(params_.radius_m));
  }
  constexpr std::size_t kCallsPerSweep = 16;
  const float limit2 = keep_radius_m_ * keep_radius_m_;
  for (std::size_t n = table_.size() / kCallsPerSweep; n > 0; --n) {
    const Voxel& v = table_[sweep_];
    if (v.key != kEmpty && (corner(v) - centre).squaredNorm() > limit2) {
      erase(sweep_);  // another may have moved into this slot: look again
    } else {
      sweep_ = (sweep_ + 1) & mask_;
    }
  }
}

void VoxelTable::insert(const Points& points) {
  const auto max_points = static_cast<float>(params_.max_points);
  Voxel* voxel = nullptr;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3f p = points[n];
    const int i = fast_floor(p.x() * per_m_);
    const int j = fast_floor(p.y() * per_m_);
    const int k = fast_floor(p.z() * per_m_);
    // Neighbours in the scan are mostly neighbours in space.
    if (voxel == nullptr || voxel->i != i || voxel->j != j || voxel->k != k) {
      voxel = find_or_add(i, j, k);
    }
    if (voxel == nullptr || voxel->count >= max_points) continue;
    Voxel& v = *voxel;
    // Welford: one pass, no cancellation.
    const Vec3f q = p - corner(v);
    v.count += 1.0F;
    const Vec3f d = q - v.mean;
    v.mean += d / v.count;
    const Vec3f e = q - v.mean;
    v.scatter[0] += d.x() * e.x();
    v.scatter[1] += d.x() * e.y();
    v.scatter[2] += d.x() * e.z();
    v.scatter[3] += d.y() * e.y();
    v.scatter[4] += d.y() * e.z();
    v.scatter[5] += d.z() * e.z();
  }
}

void VoxelTable::fit(Voxel* voxel) const {
  Voxel& v = *voxel;
  v.count_at_fit = v.count;
  v.is_surface = false;
  if (v.count < static_cast<float>(params_.min_points)) return;
  Mat3f c;
  c << v.scatter[0], v.scatter[1], v.scatter[2],  //
      v.scatter[1], v.scatter[3], v.scatter[4],   //
      v.scatter[2], v.scatter[4], v.scatter[5];
  c /= v.count - 1.0F;
  Eigen::SelfAdjointEigenSolver<Mat3f> eigen;
  eigen.computeDirect(c);
  const Vec3f lambda = eigen.eigenvalues().cwiseMax(0.0F);
  const auto thickness = static_cast<float>(params_.max_thickness);
  const float extent = static_cast<float>(params_.min_extent) * voxel_m_;
  if (lambda[1] < extent * extent || lambda[0] > thickness * thickness * lambda[1]) return;
  v.is_surface = true;
  v.normal = eigen.eigenvectors().col(0);
  v.variance_m2 = lambda[0];
  // Of a plane fitted to n points of that spread.
  v.angle_variance = lambda[0] / (v.count * lambda[1]);
}

bool VoxelTable::nearest_surface(const Vec3f& p, Surface* out) {
  const Vec3f s = p * per_m_;
  const int i = fast_floor(s.x());
  const int j = fast_floor(s.y());
  const int k = fast_floor(s.z());
  const int di = s.x() - static_cast<float>(i) < 0.5F ? -1 : 1;
  const int dj = s.y() - static_cast<float>(j) < 0.5F ? -1 : 1;
  const int dk = s.z() - static_cast<float>(k) < 0.5F ? -1 : 1;
  const std::array<std::array<int, 3>, 4> candidates = {
      {{i, j, k}, {i + di, j, k}, {i, j + dj, k}, {i, j, k + dk}}};

  const Voxel* best = nullptr;
  float best2 = 0.0F;
  for (const auto& c : candidates) {
    Voxel* v = find(pack_voxel(c[0], c[1], c[2]));
    if (v == nullptr) continue;
    // Refitting at each new point would cost more than it brings: at a tenth more points.
    if (v->count > 1.1F * v->count_at_fit) fit(v);
    if (!v->is_surface) continue;
    const float d2 = (corner(*v) + v->mean - p).squaredNorm();
    if (best == nullptr || d2 < best2) {
      best = v;
      best2 = d2;
    }
  }
  if (best == nullptr) return false;
  out->mean = corner(*best) + best->mean;
  out->normal = best->normal;
  out->variance_m2 = best->variance_m2;
  out->angle_variance = best->angle_variance;
  out->count = best->count;
  out->voxel = static_cast<std::uint32_t>(best - table_.data());
  return true;
}

RollingMap::RollingMap(const RollingMapParams& params)
    : fine_(params.voxel_m, params),
      coarse_(kCoarseRatio * params.voxel_m, params),
      coarse_id0_(static_cast<std::uint32_t>(table_size(params.capacity))) {}

std::size_t RollingMap::voxel_ids() const { return 2 * static_cast<std::size_t>(coarse_id0_); }

void RollingMap::clear() {
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
  fine_.forget_far(t);
  coarse_.forget_far(t);
  fine_.insert(points_rolling_);
  coarse_.insert(points_rolling_);
}

bool RollingMap::nearest_surface(const Vec3f& p_rolling, Surface* out) {
  if (fine_.nearest_surface(p_rolling, out)) return true;
  if (!coarse_.nearest_surface(p_rolling, out)) return false;
  out->voxel += coarse_id0_;
  return true;
}

}  // namespace rcs::sp
