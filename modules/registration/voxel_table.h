#pragma once
// Maps a cell (voxel, column, map cell) to its data of a scan: a table for one scan at a time.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "modules/registration/voxel_key.h"

namespace rcs::registration {

/// Open-addressed; cleared by incrementing a generation. No allocation once it has held as many.
template <class Value>
class ScanTable {
 public:
  /// Makes room for `cells` cells; the content is lost if the table must grow.
  void reserve(std::size_t cells) {
    std::size_t capacity = std::max<std::size_t>(entries_.size(), 1024);
    while (capacity < 2 * cells) capacity *= 2;
    if (capacity == entries_.size()) return;
    entries_.assign(capacity, {});
    generation_ = 0;
  }

  /// Clears the table, with room for `cells` cells.
  void begin(std::size_t cells) {
    reserve(cells);
    if (++generation_ != 0) return;
    std::fill(entries_.begin(), entries_.end(),
              Entry{});  // wrapped around: old entries would look new
    generation_ = 1;
  }

  /// Begins to load what find_or_add(key) reads: the table is larger than the caches.
  void prefetch(VoxelKey key) const {
    __builtin_prefetch(&entries_[scatter_voxel(key) & (entries_.size() - 1)], 1);
  }

  /// The value of a cell, and whether it is new. Its address is valid until begin().
  std::pair<Value*, bool> find_or_add(VoxelKey key) {
    const std::size_t mask = entries_.size() - 1;
    for (std::size_t at = scatter_voxel(key) & mask;; at = (at + 1) & mask) {
      Entry& entry = entries_[at];
      if (entry.generation != generation_) {
        entry = {key, generation_, {}};
        return {&entry.value, true};
      }
      if (entry.key == key) return {&entry.value, false};
    }
  }

 private:
  struct Entry {
    VoxelKey key = 0;
    std::uint32_t generation = 0;
    Value value{};
  };
  std::vector<Entry> entries_;
  std::uint32_t generation_ = 0;
};

}  // namespace rcs::registration
