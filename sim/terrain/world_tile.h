#pragma once
// A square of the world prepared for ray casting: heights, maxima by level, objects by node.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/terrain/scatter.h"

namespace rcs::sim {

/// 2^7 x 2^7 cells of 0.1 m; the ground is bilinear between the nodes at their corners. Above the
/// cells there is a pyramid of maxima: node (i, j) of level l covers 2^l x 2^l cells. Objects are
/// listed by node of level kObjectLevel (1.6 m) and included in the maxima from that level up.
struct Tile {
  static constexpr double kCell_m = 0.1;
  static constexpr double kCellsPerMetre = 10.0;
  static constexpr int kTop = 7;
  static constexpr int kCells = 1 << kTop;
  static constexpr int kNodes = kCells + 1;
  static constexpr int kBlocks = (kNodes + 3) / 4;
  static constexpr double kSize_m = kCells * kCell_m;
  static constexpr int kObjectLevel = 4;
  static constexpr int kObjectSide = kCells >> kObjectLevel;
  static constexpr int kMeadowLevel = 2;
  static constexpr int kMeadowSide = kCells >> kMeadowLevel;
  static constexpr std::size_t kObjectNodes = std::size_t{kObjectSide} * kObjectSide;

  std::vector<float> z;                            ///< of the kNodes x kNodes nodes, see node_at()
  std::vector<float> maximum;                      ///< levels 1 .. kTop, by node_index()
  std::array<float, kObjectNodes> ground_maximum;  ///< of the ground only, level kObjectLevel
  std::vector<float> meadow;  ///< of the nodes of level kMeadowLevel, row by row; > 0: grass
  std::vector<Spheroid> objects;
  /// Objects of node k: node_objects[first_object[k]] up to node_objects[first_object[k + 1]],
  /// exclusive.
  std::array<std::uint32_t, kObjectNodes + 1> first_object{};
  std::vector<std::uint16_t> node_objects;

  /// Index into `maximum` of node (i, j) of `level` >= 1.
  static std::size_t node_index(int level, int i, int j) {
    const int in_level = (j << (kTop - level)) + i;
    return kOffset[static_cast<std::size_t>(level)] + static_cast<std::size_t>(in_level);
  }
  /// Index into `first_object` of node (i, j) of level kObjectLevel.
  static std::size_t object_node(int i, int j) {
    const int node = j * kObjectSide + i;
    return static_cast<std::size_t>(node);
  }
  /// Height of node (i, j), i and j in [0, kCells].
  [[nodiscard]] float node(int i, int j) const { return z[node_at(i, j)]; }

  /// Nodes are stored in blocks of 4 x 4, a cache line each: neighbouring rays share them in any
  /// direction.
  static std::size_t node_at(int i, int j) {
    const int at = (j >> 2) * (kBlocks * 16) + (i >> 2) * 16 + (j & 3) * 4 + (i & 3);
    return static_cast<std::size_t>(at);
  }

  // Levels 1 .. 7 have 64^2, 32^2, ... 1 nodes.
  static constexpr std::array<std::size_t, kTop + 2> kOffset = {0,    0,    4096, 5120, 5376,
                                                                5440, 5456, 5460, 5461};
};

/// Tile (tx, ty) of the lattice of edge Tile::kSize_m in frame world.
[[nodiscard]] Tile make_tile(int tx, int ty, const Relief& relief, const Scatter& scatter);

}  // namespace rcs::sim
