#include "tools/mapping/standing_builder.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mapping {
namespace {

// 21 bits per axis: 100 km of cubes of 0.1 m to each side.
constexpr int kHalf = 1 << 20;
constexpr std::uint64_t kMask = (1U << 21U) - 1U;
// A surface is thin: variance across it at most the square of this times that along its narrow
// side.
constexpr double kThin = 0.25;
// Cosine of the angle between normal and view, so that the front was observed.
constexpr double kFacing = 0.2;
// Lower bound of the sigma of a mean, for any number of returns.
constexpr double kMinSigma_m = 0.02;

std::array<int, 3> place_of(std::uint64_t key) {
  const auto axis = [key](unsigned shift) {
    return static_cast<int>((key >> shift) & kMask) - kHalf;
  };
  return {axis(0), axis(21), axis(42)};
}

}  // namespace

std::uint64_t StandingBuilder::key_of(const VoxelIndex& at) {
  std::uint64_t key = 0;
  for (std::size_t k = 3; k-- > 0;) {
    key = (key << 21U) | (static_cast<std::uint64_t>(at[k] + kHalf) & kMask);
  }
  return key;
}

Vec3 StandingBuilder::mean(const VoxelIndex& at, const Voxel& v) const {
  return params_.voxel_m * Vec3(at[0], at[1], at[2]) +
         (v.sum_m / static_cast<float>(v.returns)).cast<double>();
}

void StandingBuilder::add(const Vec3& p, const Vec3& from, std::uint32_t scan) {
  const Vec3 in_voxels = p / params_.voxel_m;
  if (!in_voxels.allFinite() || in_voxels.cwiseAbs().maxCoeff() > kHalf - 100) return;
  const VoxelIndex at{static_cast<int>(std::floor(in_voxels.x())),
                      static_cast<int>(std::floor(in_voxels.y())),
                      static_cast<int>(std::floor(in_voxels.z()))};
  Voxel& v = voxels_[key_of(at)];
  if (v.returns == 0) {
    v.first_from_m = from.cast<float>();
    v.first_scan = scan;
  }
  v.sum_m += (p - params_.voxel_m * Vec3(at[0], at[1], at[2])).cast<float>();
  v.towards += (from - p).normalized().cast<float>();
  v.way_m = std::max(v.way_m, (from.cast<float>() - v.first_from_m).norm());
  ++v.returns;
  v.scan = scan;
}

bool StandingBuilder::fit(const VoxelIndex& at, const Voxel& v, Found* out) const {
  const Vec3 here = mean(at, v);
  const int wide = static_cast<int>(std::ceil(params_.wide_m / params_.voxel_m));
  const int tall = static_cast<int>(std::ceil(params_.tall_m / params_.voxel_m));
  std::uint32_t low_scan = v.scan;
  std::uint32_t high_scan = v.scan;
  float way_m = 0.0F;
  double n = 0.0;
  Vec3 sum = Vec3::Zero();
  Mat3 squares = Mat3::Zero();
  for (int k = -tall; k <= tall; ++k) {
    for (int j = -wide; j <= wide; ++j) {
      for (int i = -wide; i <= wide; ++i) {
        const VoxelIndex near{at[0] + i, at[1] + j, at[2] + k};
        const auto found = voxels_.find(key_of(near));
        if (found == voxels_.end()) continue;
        const Vec3 d = mean(near, found->second) - here;
        if (d.head<2>().norm() > params_.wide_m || std::abs(d.z()) > params_.tall_m) continue;
        const double w = found->second.returns;
        low_scan = std::min(low_scan, found->second.first_scan);
        high_scan = std::max(high_scan, found->second.scan);
        way_m = std::max(
            {way_m, found->second.way_m, (found->second.first_from_m - v.first_from_m).norm()});
        n += w;
        sum += w * d;
        squares += w * d * d.transpose();
      }
    }
  }
  if (n < params_.min_returns || static_cast<double>(way_m) < params_.min_travelled_m ||
      static_cast<int>(high_scan - low_scan) < params_.min_scans) {
    return false;
  }
  const Vec3 middle = sum / n;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(squares / n - middle * middle.transpose());
  const Vec3 variance = axes.eigenvalues().cwiseMax(0.0);
  if (std::sqrt(variance[0]) > params_.max_thick_m || variance[0] > kThin * variance[1]) {
    return false;
  }
  Vec3 normal = axes.eigenvectors().col(0);
  const Vec3 towards = v.towards.cast<double>().normalized();
  if (normal.dot(towards) < 0.0) normal = -normal;
  if (normal.dot(towards) < kFacing) return false;
  out->p_m = here + normal * normal.dot(middle);  // onto the plane
  out->normal = normal.cast<float>().normalized();
  out->sigma_m = static_cast<float>(std::hypot(std::sqrt(variance[0]), kMinSigma_m));
  return true;
}

void StandingBuilder::finish(const std::function<bool(double, double)>& transient) {
  std::vector<std::uint64_t> keys;
  for (const auto& [key, v] : voxels_) {  // in any order: sorted then
    if (v.scan != v.first_scan) keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  for (const std::uint64_t key : keys) {
    Found found;
    const VoxelIndex at = place_of(key);
    if (!fit(at, voxels_.at(key), &found) || transient(found.p_m.x(), found.p_m.y())) continue;
    found_.push_back(found);
  }
  voxels_.clear();
}

std::size_t StandingBuilder::bytes() const {
  constexpr std::size_t kNode = 24;  // of the table, by entry
  return voxels_.size() * (sizeof(Voxel) + kNode) + found_.size() * sizeof(Found);
}

std::vector<SurfacePoint> StandingBuilder::points(const MapLevel& level, Cell tile) const {
  RCS_CHECK(level.origin_m == Vec2::Zero());
  const double side_m = level.cell_m * kTileSide;
  const Vec3 corner(side_m * tile.i, side_m * tile.j, 0.0);
  std::vector<SurfacePoint> points;
  for (const Found& f : found_) {
    const Vec3f p = (f.p_m - corner).cast<float>();
    const bool inside = p.x() >= 0.0F && p.y() >= 0.0F && p.x() < side_m && p.y() < side_m;
    if (inside) points.push_back({p, f.normal, f.sigma_m});
  }
  return thinned(points, params_.thin_m, kMaxSurfacePoints);
}

}  // namespace rcs::mapping
