#pragma once
// Maps the key of a voxel to its number: an open-addressed table of fixed size.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/registration/voxel_key.h"

namespace rcs::registration {

class VoxelIndex {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// @param capacity  largest number of voxels; the table is twice as large
  explicit VoxelIndex(std::size_t capacity) {
    std::size_t size = 64;
    while (size < 2 * capacity) size *= 2;
    slots_.resize(size);
    mask_ = size - 1;
  }

  void clear() { slots_.assign(slots_.size(), Slot{}); }

  /// Begins to load what find(key) reads: the table is larger than the caches.
  void prefetch(VoxelKey key) const { __builtin_prefetch(&slots_[hash_voxel(key) & mask_]); }

  /// kNone: not in it.
  [[nodiscard]] std::uint32_t find(VoxelKey key) const {
    for (std::size_t at = hash_voxel(key) & mask_;; at = (at + 1) & mask_) {
      const Slot& slot = slots_[at];
      if (slot.key == key) return slot.number;
      if (slot.key == kEmpty) return kNone;
    }
  }

  /// The number of a voxel, which becomes `fresh` if it is not in the table yet; with kNone for
  /// `fresh` it is not added.
  std::uint32_t find_or_add(VoxelKey key, std::uint32_t fresh) {
    for (std::size_t at = hash_voxel(key) & mask_;; at = (at + 1) & mask_) {
      Slot& slot = slots_[at];
      if (slot.key == key) return slot.number;
      if (slot.key != kEmpty) continue;
      if (fresh != kNone) slot = {key, fresh};
      return fresh;
    }
  }

  /// Backward-shift deletion: no tombstones, so that the table does not age.
  void erase(VoxelKey key) {
    std::size_t hole = hash_voxel(key) & mask_;
    while (slots_[hole].key != key) {
      if (slots_[hole].key == kEmpty) return;
      hole = (hole + 1) & mask_;
    }
    for (std::size_t next = (hole + 1) & mask_; slots_[next].key != kEmpty;
         next = (next + 1) & mask_) {
      const std::size_t home = hash_voxel(slots_[next].key) & mask_;
      if (((next - home) & mask_) >= ((next - hole) & mask_)) {
        slots_[hole] = slots_[next];
        hole = next;
      }
    }
    slots_[hole] = Slot{};
  }

 private:
  static constexpr VoxelKey kEmpty = ~VoxelKey{0};
  struct Slot {
    VoxelKey key = kEmpty;
    std::uint32_t number = kNone;
  };
  std::vector<Slot> slots_;
  std::size_t mask_ = 0;
};

}  // namespace rcs::registration
