#include "modules/bg/obstacle_distance.h"

#include <algorithm>

namespace rcs::bg {
namespace {

constexpr int kNowhere = 10'000;  // cells; its square still fits an int

}  // namespace

void ObstacleDistance::take_from(int i, int j, int di, int dj) {
  const int a = i + di;
  const int b = j + dj;
  if (a < 0 || b < 0 || a >= width_ || b >= height_) return;
  const Offset theirs = nearest_[index(a, b)];
  if (theirs.i == kNowhere) return;
  const Offset mine{theirs.i + di, theirs.j + dj};
  Offset& best = nearest_[index(i, j)];
  if (mine.i * mine.i + mine.j * mine.j < best.i * best.i + best.j * best.j) best = mine;
}

void ObstacleDistance::compute(const vj::Terrain& terrain, const vj::Weights& weights) {
  cell_m_ = terrain.cell_m;
  first_ = terrain.first;
  width_ = terrain.width;
  height_ = terrain.height;
  nearest_.assign(terrain.ground.size(), {kNowhere, kNowhere});
  distance_m_.resize(terrain.ground.size());
  for (std::size_t k = 0; k < terrain.ground.size(); ++k) {
    if (!vj::passable(terrain.ground[k], weights)) nearest_[k] = {0, 0};
  }
  // Two sweeps, each with a return pass along the row.
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) {
      take_from(i, j, -1, 0);
      take_from(i, j, -1, -1);
      take_from(i, j, 0, -1);
      take_from(i, j, 1, -1);
    }
    for (int i = width_ - 1; i >= 0; --i) take_from(i, j, 1, 0);
  }
  for (int j = height_ - 1; j >= 0; --j) {
    for (int i = width_ - 1; i >= 0; --i) {
      take_from(i, j, 1, 0);
      take_from(i, j, 1, 1);
      take_from(i, j, 0, 1);
      take_from(i, j, -1, 1);
    }
    for (int i = 0; i < width_; ++i) take_from(i, j, -1, 0);
  }
  for (std::size_t k = 0; k < nearest_.size(); ++k) {
    const Offset o = nearest_[k];
    const double cells = std::sqrt(static_cast<double>(o.i * o.i + o.j * o.j)) - 0.5;
    distance_m_[k] = o.i == kNowhere ? kFar_m : std::clamp(cells * cell_m_, 0.0, kFar_m);
  }
}

}  // namespace rcs::bg
