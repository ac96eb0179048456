#include "modules/registration/voxel_sampler.h"

#include <algorithm>
#include <array>

#include "modules/registration/voxel_key.h"
#include "rcs/base/check.h"

namespace rcs::registration {

void keep_evenly(std::size_t most, Points* points) {
  const std::size_t n = points->size();
  if (n <= most) return;
  for (std::size_t k = 0; k < most; ++k) {
    const std::size_t from = k * n / most;
    points->x[k] = points->x[from];
    points->y[k] = points->y[from];
    points->z[k] = points->z[from];
  }
  points->resize(most);
}

Points thinned(const Points& in, int wanted) {
  RCS_CHECK(wanted > 0);
  // Odd, so that it does not alias with the rows of a sensor.
  const std::size_t stride = (in.size() / static_cast<std::size_t>(wanted)) | 1U;
  Points out;
  out.reserve(in.size() / stride + 1);
  for (std::size_t i = 0; i < in.size(); i += stride) out.push_back(in[i]);
  return out;
}

void VoxelSampler::sample(const Points& in, double voxel_m, Points* out) {
  RCS_CHECK(voxel_m > 0.0);
  out->clear();
  const std::size_t n = in.size();
  table_.begin(n);
  const float per_m = 1.0F / static_cast<float>(voxel_m);
  VoxelKey last = ~VoxelKey{0};
  constexpr std::size_t kBlock = 64;  // whose memory accesses overlap
  std::array<VoxelKey, kBlock> keys;
  for (std::size_t first = 0; first < n; first += kBlock) {
    const std::size_t m = std::min(kBlock, n - first);
    for (std::size_t i = 0; i < m; ++i) {
      keys[i] = pack_voxel(fast_floor(in.x[first + i] * per_m), fast_floor(in.y[first + i] * per_m),
                           fast_floor(in.z[first + i] * per_m));
      table_.prefetch(keys[i]);
    }
    for (std::size_t i = 0; i < m; ++i) {
      if (keys[i] == last) continue;  // neighbours in the scan are mostly neighbours in space
      last = keys[i];
      if (table_.find_or_add(keys[i]).second) out->push_back(in[first + i]);
    }
  }
}

}  // namespace rcs::registration
