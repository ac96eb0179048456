#pragma once
// Voxels that left the rolling map, by tile, for a vehicle that drives back where it came from.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/registration/point_moments.h"
#include "modules/registration/voxel_index.h"

namespace rcs::registration {

/// A voxel of the map and the distance driven when its first point was inserted.
struct Voxel {
  std::int32_t i = 0, j = 0, k = 0;
  Moments moments;            ///< from the voxel's lowest corner; empty: free
  float fit_again_at = 0.0F;  ///< points
  float since_m = 0.0F;       ///< distance driven when it was added
};

class MapArchive {
 public:
  /// @param tile_voxels  edge of a square tile
  /// @param capacity  voxels; the tiles that left the map first are dropped first. 0: none is kept
  MapArchive(int tile_voxels, std::size_t capacity);

  /// @param way_m  distance driven when the voxel leaves the map
  void put(const Voxel& voxel, float way_m);
  void clear();

  /// The tile nearest to voxel (i, j) whose centre lies within `reach` voxels, and which left the
  /// map when `way_m` or more had been driven: what was in the map together with what it has now.
  /// @return number for take(); kNone: there is none
  [[nodiscard]] std::uint32_t nearest(int i, int j, int reach, float way_m) const;

  /// Calls `add` with each voxel of a tile, and removes the tile.
  template <class Add>
  void take(std::uint32_t tile, const Add& add) {
    for (std::uint32_t at = tiles_[tile].head; at != kNone; at = entries_[at].next) {
      add(entries_[at].voxel);
    }
    drop(tile);
  }

  [[nodiscard]] std::size_t size() const { return used_; }
  static constexpr std::uint32_t kNone = VoxelIndex::kNone;

 private:
  struct Tile {
    std::int32_t i = 0, j = 0;
    float left_m = -1.0F;        // distance driven when its newest voxel left the map; < 0: free
    std::uint32_t head = kNone;  // of its entries
    std::size_t size = 0;
  };
  struct Entry {
    Voxel voxel;
    std::uint32_t next = kNone;
  };

  [[nodiscard]] int tile_of(int i) const;
  std::uint32_t find_or_add(int i, int j);
  void drop(std::uint32_t tile);
  void make_room();

  int tile_voxels_;
  std::size_t capacity_;
  VoxelIndex index_;
  std::vector<Tile> tiles_;
  std::vector<std::uint32_t> free_tiles_;
  std::vector<Entry> entries_;
  std::uint32_t free_entry_ = kNone;
  std::size_t used_ = 0;
};

}  // namespace rcs::registration
