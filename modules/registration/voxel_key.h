#pragma once
// Integer voxel coordinates packed into one word, and a hash of it.

#include <cmath>
#include <cstdint>

#include "rcs/base/linear.h"

namespace rcs::registration {

/// 21 bits an axis: +-1,048,576 voxels, 524 km at 0.5 m.
using VoxelKey = std::uint64_t;

inline VoxelKey pack_voxel(int i, int j, int k) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1U;
  return (static_cast<std::uint64_t>(i) & kMask) |
         ((static_cast<std::uint64_t>(j) & kMask) << 21U) |
         ((static_cast<std::uint64_t>(k) & kMask) << 42U);
}

inline int fast_floor(float v) {
  const int i = static_cast<int>(v);
  return i - static_cast<int>(v < static_cast<float>(i));
}

/// For tables whose accesses are prefetched: fewer collisions than hash_voxel().
inline std::uint64_t scatter_voxel(VoxelKey key) {
  key ^= key >> 29U;
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 32U);
}

/// Blocks of 4 x 4 x 4 voxels are scattered (Fibonacci hashing after mixing); within one,
/// neighbours stay neighbours, so that the next lookup is in the cache.
inline std::uint64_t hash_voxel(VoxelKey key) {
  constexpr std::uint64_t kLow = 3U;
  const std::uint64_t inside =
      (key & kLow) | ((key >> 19U) & (kLow << 2U)) | ((key >> 38U) & (kLow << 4U));
  std::uint64_t block = key & ~(kLow | (kLow << 21U) | (kLow << 42U));
  block ^= block >> 29U;
  block *= 0x9E3779B97F4A7C15ULL;
  block ^= block >> 32U;
  return (block << 6U) | inside;
}

}  // namespace rcs::registration
