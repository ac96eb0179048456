#include "modules/registration/map_archive.h"

#include <algorithm>

#include "rcs/base/check.h"

namespace rcs::registration {
namespace {

/// A tile holds many voxels; with this many tiles the voxels are what limits.
constexpr std::size_t kVoxelsPerTile = 16;

}  // namespace

MapArchive::MapArchive(int tile_voxels, std::size_t capacity)
    : tile_voxels_(tile_voxels), capacity_(capacity), index_(capacity / kVoxelsPerTile) {
  RCS_CHECK(tile_voxels > 0);
  tiles_.reserve(capacity / kVoxelsPerTile);
  free_tiles_.reserve(capacity / kVoxelsPerTile);
  entries_.reserve(capacity);
}

int MapArchive::tile_of(int i) const {
  return i >= 0 ? i / tile_voxels_ : -((-i - 1) / tile_voxels_) - 1;
}

void MapArchive::clear() {
  index_.clear();
  tiles_.clear();
  free_tiles_.clear();
  entries_.clear();
  free_entry_ = kNone;
  used_ = 0;
}

std::uint32_t MapArchive::find_or_add(int i, int j) {
  const bool reuses = !free_tiles_.empty();
  const std::uint32_t fresh =
      reuses ? free_tiles_.back() : static_cast<std::uint32_t>(tiles_.size());
  const std::uint32_t number = index_.find_or_add(pack_voxel(i, j, 0), fresh);
  if (number != fresh) return number;
  if (reuses) {
    free_tiles_.pop_back();
  } else {
    tiles_.emplace_back();
  }
  tiles_[number] = {i, j, 0.0F, kNone, 0};
  return number;
}

void MapArchive::put(const Voxel& voxel, float way_m) {
  if (capacity_ < kVoxelsPerTile) return;
  make_room();
  const std::uint32_t number = find_or_add(tile_of(voxel.i), tile_of(voxel.j));
  Tile& tile = tiles_[number];
  std::uint32_t at = free_entry_;
  if (at != kNone) {
    free_entry_ = entries_[at].next;
  } else {
    at = static_cast<std::uint32_t>(entries_.size());
    entries_.emplace_back();
  }
  entries_[at] = {voxel, tile.head};
  tile.head = at;
  tile.left_m = way_m;
  ++tile.size;
  ++used_;
}

void MapArchive::drop(std::uint32_t number) {
  Tile& tile = tiles_[number];
  index_.erase(pack_voxel(tile.i, tile.j, 0));
  for (std::uint32_t at = tile.head; at != kNone;) {
    const std::uint32_t next = entries_[at].next;
    entries_[at].next = free_entry_;
    free_entry_ = at;
    at = next;
  }
  used_ -= tile.size;
  tile = {};
  free_tiles_.push_back(number);
}

void MapArchive::make_room() {
  const bool tiles_left = !free_tiles_.empty() || tiles_.size() < capacity_ / kVoxelsPerTile;
  if (used_ < capacity_ && tiles_left) return;
  const auto first =
      std::min_element(tiles_.begin(), tiles_.end(), [](const Tile& a, const Tile& b) {
        return (a.left_m >= 0.0F && b.left_m < 0.0F) ||
               (a.left_m >= 0.0F && b.left_m >= 0.0F && a.left_m < b.left_m);
      });
  drop(static_cast<std::uint32_t>(first - tiles_.begin()));
}

std::uint32_t MapArchive::nearest(int i, int j, int reach, float way_m) const {
  const int ti = tile_of(i);
  const int tj = tile_of(j);
  const int tiles = reach / tile_voxels_ + 1;
  const auto reach2 = static_cast<double>(reach) * reach;
  std::uint32_t best = kNone;
  double best2 = reach2;
  for (int b = tj - tiles; b <= tj + tiles; ++b) {
    for (int a = ti - tiles; a <= ti + tiles; ++a) {
      const std::uint32_t number = index_.find(pack_voxel(a, b, 0));
      if (number == kNone || tiles_[number].left_m < way_m) continue;
      const double di = (a + 0.5) * tile_voxels_ - i;
      const double dj = (b + 0.5) * tile_voxels_ - j;
      const double distance2 = di * di + dj * dj;
      if (distance2 > best2) continue;
      best2 = distance2;
      best = number;
    }
  }
  return best;
}

}  // namespace rcs::registration
