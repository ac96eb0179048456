#pragma once
// Random numbers by position instead of by order: the world is the same in whatever order its parts
// are created.

#include <cstdint>

namespace rcs::sim {

/// The finalizer of SplitMix64 (Steele, Lea & Flood 2014): every input bit affects every output
/// bit.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

inline std::uint64_t hash_cell(std::uint64_t seed, int i, int j) {
  return mix(seed ^ ((static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U) |
                     static_cast<std::uint32_t>(j)));
}

/// Uniform in [0, 1).
inline double to_unit(std::uint64_t hash) {
  return static_cast<double>(hash >> 11U) * (1.0 / 9007199254740992.0);
}

/// A short stream of uniform numbers for one position.
class PlaceRandom {
 public:
  explicit PlaceRandom(std::uint64_t hash) : state_(hash) {}
  double uniform(double low, double high) { return low + (high - low) * next(); }
  double next() {
    state_ = mix(state_);
    return to_unit(state_);
  }

 private:
  std::uint64_t state_;
};

}  // namespace rcs::sim
