#pragma once
// Values of cells on an unbounded lattice.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "rcs/base/grid.h"

namespace rcs::mapping {

/// An unbounded lattice; blocks of 32 x 32 cells are allocated when written to.
template <class T>
class CellBlocks {
 public:
  static constexpr int kSide = 32;
  static constexpr std::size_t kBlockBytes = sizeof(T) * kSide * kSide;

  /// The value of the cell; its block is created with T() if missing. The address is stable.
  T& at(Cell c) {
    const std::uint64_t key = key_of(c);
    if (key != key_ || newest_ == nullptr) {
      std::unique_ptr<Block>& block = blocks_[key];
      if (block == nullptr) block = std::make_unique<Block>();
      newest_ = block.get();
      key_ = key;
    }
    return (*newest_)[index_of(c)];
  }

  /// nullptr if no cell of the block was written to.
  [[nodiscard]] const T* find(Cell c) const {
    const auto found = blocks_.find(key_of(c));
    return found == blocks_.end() ? nullptr : &(*found->second)[index_of(c)];
  }
  [[nodiscard]] T* find(Cell c) {
    const auto found = blocks_.find(key_of(c));
    return found == blocks_.end() ? nullptr : &(*found->second)[index_of(c)];
  }

  [[nodiscard]] std::size_t bytes() const { return blocks_.size() * kBlockBytes; }

  /// The lowest cells of all blocks, by j, then i.
  [[nodiscard]] std::vector<Cell> blocks() const {
    std::vector<Cell> cells;
    cells.reserve(blocks_.size());
    for (const auto& entry : blocks_) {
      cells.push_back({static_cast<std::int32_t>(entry.first & 0xFFFFFFFFU) * kSide,
                       static_cast<std::int32_t>(entry.first >> 32U) * kSide});
    }
    std::sort(cells.begin(), cells.end(),
              [](Cell a, Cell b) { return a.j != b.j ? a.j < b.j : a.i < b.i; });
    return cells;
  }

  /// Calls f(cell, value) for every cell of every block, in an order that depends on the cells
  /// alone.
  template <class F>
  void for_each(const F& f) const {
    for (const Cell first : blocks()) {
      const Block& block = *blocks_.at(key_of(first));
      for (int k = 0; k < kSide * kSide; ++k) {
        f(Cell{first.i + k % kSide, first.j + k / kSide}, block[static_cast<std::size_t>(k)]);
      }
    }
  }

 private:
  using Block = std::array<T, std::size_t{kSide} * kSide>;
  static constexpr int kShift = 5;

  static std::uint64_t key_of(Cell c) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.j >> kShift)) << 32U |
           static_cast<std::uint32_t>(c.i >> kShift);
  }
  static std::size_t index_of(Cell c) {
    return static_cast<std::size_t>((c.j & (kSide - 1)) * kSide + (c.i & (kSide - 1)));
  }

  std::unordered_map<std::uint64_t, std::unique_ptr<Block>> blocks_;
  std::uint64_t key_ = 0;
  Block* newest_ = nullptr;
};

}  // namespace rcs::mapping
