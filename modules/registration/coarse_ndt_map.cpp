#include "modules/registration/coarse_ndt_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

namespace rcs::registration {
namespace {

constexpr float kFewest = 4.0F;     // minimum points of a distribution
constexpr float kThinnest = 0.01F;  // middle standard deviation over the voxel's edge

}  // namespace

WideMap::Level::Level(double voxel, std::size_t capacity)
    : voxel_m(static_cast<float>(voxel)),
      per_m(1.0F / static_cast<float>(voxel)),
      index(capacity) {}

template <class Visit>
void WideMap::Level::add(const Visit& visit_all) {
  visit_all([this](const Moments& m, const Vec3f& origin) {
    const Vec3f p = (m.mean + origin) * per_m;
    const auto fresh = static_cast<std::uint32_t>(moments.size());
    const VoxelKey key = pack_voxel(fast_floor(p.x()), fast_floor(p.y()), fast_floor(p.z()));
    const std::uint32_t number = index.find_or_add(key, fresh);
    if (number == fresh) {
      moments.emplace_back();
      keys.push_back(key);
    }
    moments[number].add(m, origin);
  });
}

void WideMap::Level::fit(const WideMapParams& params) {
  index = VoxelIndex(moments.size());
  const auto noise = static_cast<float>(params.range_sigma_m * params.range_sigma_m);
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const Moments& m = moments[k];
    if (m.count < kFewest) continue;
    Eigen::SelfAdjointEigenSolver<Mat3f> eigen;
    eigen.computeDirect(m.covariance());
    Vec3f lambda = eigen.eigenvalues().cwiseMax(0.0F);
    if (lambda[1] < kThinnest * kThinnest * voxel_m * voxel_m) continue;
    lambda = lambda.cwiseMax(static_cast<float>(params.flatness) * lambda[2]);
    lambda.array() += noise;
    const Mat3f V = eigen.eigenvectors();
    const Mat3f L = V * lambda.cwiseInverse().asDiagonal() * V.transpose();
    index.find_or_add(keys[k], static_cast<std::uint32_t>(gaussians.size()));
    gaussians.push_back({m.mean, {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)}});
  }
}

WideMap::WideMap(const RollingMap& map, const WideMapParams& params) {
  std::size_t finer = map.coarse().size();
  for (std::size_t n = kVoxel_m.size(); n-- > 0;) {
    Level level(kVoxel_m[n], finer);
    if (levels_.empty()) {
      level.add([&map](const auto& visit) { map.coarse().for_each(visit); });
    } else {
      const Level& last = levels_.front();
      level.add([&last](const auto& visit) {
        for (const Moments& m : last.moments) visit(m, Vec3f::Zero());
      });
    }
    level.fit(params);
    finer = level.moments.size();
    levels_.insert(levels_.begin(), std::move(level));
  }
}

const WideMap::Gaussian* WideMap::nearest(std::size_t level, const Vec3f& p) const {
  const Level& l = levels_[level];
  const Vec3f s = p * l.per_m;
  const int i = fast_floor(s.x());
  const int j = fast_floor(s.y());
  const int k = fast_floor(s.z());
  const int di = s.x() - static_cast<float>(i) < 0.5F ? -1 : 1;
  const int dj = s.y() - static_cast<float>(j) < 0.5F ? -1 : 1;
  const int dk = s.z() - static_cast<float>(k) < 0.5F ? -1 : 1;
  const Gaussian* best = nullptr;
  float best2 = 0.0F;
  for (int n = 0; n < 8; ++n) {
    const std::uint32_t number = l.index.find(pack_voxel(
        i + ((n & 1) != 0 ? di : 0), j + ((n & 2) != 0 ? dj : 0), k + ((n & 4) != 0 ? dk : 0)));
    if (number == VoxelIndex::kNone) continue;
    const float d2 = (l.gaussians[number].mean - p).squaredNorm();
    if (best == nullptr || d2 < best2) {
      best = &l.gaussians[number];
      best2 = d2;
    }
  }
  return best;
}

}  // namespace rcs::registration
