#include "sim/terrain/world_tile.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::sim {
namespace {

void add_ground_maxima(Tile* tile) {
  for (int j = 0; j < Tile::kCells; j += 2) {
    for (int i = 0; i < Tile::kCells; i += 2) {
      float& highest = tile->maximum[Tile::node_index(1, i / 2, j / 2)];
      for (int b = 0; b <= 2; ++b) {
        for (int a = 0; a <= 2; ++a) highest = std::max(highest, tile->node(i + a, j + b));
      }
    }
  }
}

void add_higher_maxima(int first_level, int last_level, Tile* tile) {
  for (int level = first_level; level <= last_level; ++level) {
    const int side = Tile::kCells >> level;
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        float& highest = tile->maximum[Tile::node_index(level, i, j)];
        for (int child = 0; child < 4; ++child) {
          const std::size_t at =
              Tile::node_index(level - 1, 2 * i + (child & 1), 2 * j + (child >> 1));
          highest = std::max(highest, tile->maximum[at]);
        }
      }
    }
  }
}

// First and last node of one axis that [low_m, high_m] of the tile touches; none: first > last.
std::array<int, 2> node_range(double low_m, double high_m) {
  constexpr double kNode_m = Tile::kSize_m / Tile::kObjectSide;
  return {std::max(0, static_cast<int>(std::floor(low_m / kNode_m))),
          std::min(Tile::kObjectSide - 1, static_cast<int>(std::floor(high_m / kNode_m)))};
}

void add_objects(const std::vector<Spheroid>& near, const Vec2& corner_world, Tile* tile) {
  std::array<std::vector<std::uint16_t>, Tile::kObjectNodes> lists;
  for (const Spheroid& object : near) {
    const double reach_m = object.radius_m + object.sway_m;
    const Vec2 p = object.centre_world.head<2>() - corner_world;
    const std::array<int, 2> x = node_range(p.x() - reach_m, p.x() + reach_m);
    const std::array<int, 2> y = node_range(p.y() - reach_m, p.y() + reach_m);
    if (x[0] > x[1] || y[0] > y[1]) continue;
    // A millimetre more than the rounding to float.
    const float top = static_cast<float>(object.centre_world.z() + object.half_height_m) + 1e-3F;
    const std::uint16_t index = static_cast<std::uint16_t>(tile->objects.size());
    tile->objects.push_back(object);
    for (int j = y[0]; j <= y[1]; ++j) {
      for (int i = x[0]; i <= x[1]; ++i) {
        lists[Tile::object_node(i, j)].push_back(index);
        float& highest = tile->maximum[Tile::node_index(Tile::kObjectLevel, i, j)];
        highest = std::max(highest, top);
      }
    }
  }
  for (std::size_t k = 0; k < lists.size(); ++k) {
    tile->first_object[k] = static_cast<std::uint32_t>(tile->node_objects.size());
    tile->node_objects.insert(tile->node_objects.end(), lists[k].begin(), lists[k].end());
  }
  tile->first_object[lists.size()] = static_cast<std::uint32_t>(tile->node_objects.size());
}

}  // namespace

Tile make_tile(int tx, int ty, const Relief& relief, const Scatter& scatter) {
  Tile tile;
  std::vector<float> rows;
  relief.fill(std::int64_t{tx} * Tile::kCells, std::int64_t{ty} * Tile::kCells, Tile::kCell_m,
              Tile::kNodes, Tile::kNodes, &rows);
  tile.z.assign(std::size_t{Tile::kBlocks} * Tile::kBlocks * 16, 0.0F);
  std::size_t at = 0;
  for (int j = 0; j < Tile::kNodes; ++j) {
    for (int i = 0; i < Tile::kNodes; ++i, ++at) tile.z[Tile::node_at(i, j)] = rows[at];
  }
  tile.maximum.assign(Tile::kOffset.back(), -std::numeric_limits<float>::infinity());
  add_ground_maxima(&tile);
  add_higher_maxima(2, Tile::kObjectLevel, &tile);
  std::copy_n(tile.maximum.begin() +
                  static_cast<std::ptrdiff_t>(Tile::node_index(Tile::kObjectLevel, 0, 0)),
              Tile::kObjectNodes, tile.ground_maximum.begin());
  scatter.fill_meadow(std::int64_t{tx} * Tile::kMeadowSide, std::int64_t{ty} * Tile::kMeadowSide,
                      Tile::kSize_m / Tile::kMeadowSide, Tile::kMeadowSide, &tile.meadow);
  // Objects of a neighbouring tile may extend into this one.
  std::vector<Spheroid> near;
  for (int b = ty - 1; b <= ty + 1; ++b) {
    for (int a = tx - 1; a <= tx + 1; ++a) scatter.grow(a, b, tx, ty, Tile::kSize_m, relief, &near);
  }
  add_objects(near, Tile::kSize_m * Vec2(tx, ty), &tile);
  add_higher_maxima(Tile::kObjectLevel + 1, Tile::kTop, &tile);
  return tile;
}

}  // namespace rcs::sim
