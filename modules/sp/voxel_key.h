#pragma once
// Integer voxel coordinates packed into one word, and a hash of it.

#include <cmath>
#include <cstdint>

#include "rcs/base/linear.h"

namespace rcs::sp {

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

/// Fibonacci hashing after mixing: neighbouring voxels must not share a probe sequence.
inline std::uint64_t hash_voxel(VoxelKey key) {
  key ^= key >> 29U;
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 32U);
}

}  // namespace rcs::sp
