#include "tools/mapping/coarser.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mapping {
namespace {

constexpr double kShared =
    1.0 / 9.0;  // share of the variance of a cell that is common to its neighbours
constexpr int kMinKnown = kCoarser * kCoarser / 2;

struct Mean {
  int known = 0;
  double z_m = 0.0;
  double square = 0.0;  // sum of squares of sigma and of the deviation from the plane
  std::uint32_t count = 0;
  std::uint16_t date = 0;
  CellSource source = CellSource::kUnknown;
};

/// Statistics of the 4 x 4 cells from (i0, j0) on, indices within `fine`.
Mean mean_of(const Raster& fine, int i0, int j0) {
  Mean m;
  Mat3 A = Mat3::Zero();  // least squares of z = a + b x + c y about the centre of the block
  Vec3 g = Vec3::Zero();
  double zz = 0.0;
  double sigma_square = 0.0;
  float reference = 0.0F;  // heights are large, deviations small
  for (int j = 0; j < kCoarser; ++j) {
    for (int i = 0; i < kCoarser; ++i) {
      const std::size_t k =
          static_cast<std::size_t>(j0 + j) * static_cast<std::size_t>(fine.width) +
          static_cast<std::size_t>(i0 + i);
      if (std::isnan(fine.z_m[k])) continue;
      if (m.known == 0) reference = fine.z_m[k];
      const double z = fine.z_m[k] - reference;
      const Vec3 b(1.0, i - 1.5, j - 1.5);
      A += b * b.transpose();
      g += b * z;
      zz += z * z;
      const double sigma = layer_at(fine.sigma_m, k);
      sigma_square += sigma * sigma;
      m.count += layer_at(fine.count, k);
      m.date = std::max(m.date, layer_at(fine.date, k));
      const CellSource source = layer_at(fine.source, k);
      m.source = m.known == 0 || m.source == source ? source : CellSource::kMixed;
      ++m.known;
    }
  }
  if (m.known < kMinKnown) return m;
  // Half of the cells or more are never collinear: they cover at least two rows and two columns.
  const Vec3 plane = A.ldlt().solve(g);
  m.z_m = reference + plane[0];
  // The errors of the cells are part of the deviation from the plane. They average out, except for
  // the part common to neighbours.
  const double n = m.known;
  const double own = sigma_square / n;
  const double deviates = std::max(0.0, zz - plane.dot(g)) / std::max(1.0, n - 3.0);
  m.square = std::max(0.0, deviates - own) + own * std::max(1.0 / n, kShared);
  return m;
}

}  // namespace

void paste_coarser(const Raster& fine, Raster* coarse) {
  RCS_CHECK(fine.first.i % kCoarser == 0 && fine.first.j % kCoarser == 0 &&
            fine.width % kCoarser == 0 && fine.height % kCoarser == 0);
  const std::size_t n = coarse->cells();
  if (coarse->sigma_m.size() != n) coarse->sigma_m.assign(n, coarse->sigma_m.front());
  if (coarse->count.size() != n) coarse->count.assign(n, coarse->count.front());
  if (coarse->date.size() != n) coarse->date.assign(n, coarse->date.front());
  if (coarse->source.size() != n) coarse->source.assign(n, coarse->source.front());
  for (int j = 0; j < fine.height; j += kCoarser) {
    for (int i = 0; i < fine.width; i += kCoarser) {
      const Mean m = mean_of(fine, i, j);
      if (m.known < kMinKnown) continue;
      const std::size_t to =
          coarse->at({(fine.first.i + i) / kCoarser, (fine.first.j + j) / kCoarser});
      coarse->z_m[to] = static_cast<float>(m.z_m);
      coarse->sigma_m[to] = static_cast<float>(std::sqrt(m.square));
      coarse->count[to] = static_cast<std::uint16_t>(std::min<std::uint32_t>(m.count, 65535));
      coarse->date[to] = m.date;
      coarse->source[to] = m.source;
    }
  }
}

std::vector<Raster> with_coarser_levels(Raster finest) {
  std::vector<Raster> levels;
  levels.push_back(std::move(finest));
  while (std::max(levels.back().width, levels.back().height) > kTileSide) {
    const Raster& last = levels.back();
    // Whole cells of the coarser level.
    const Cell low{last.first.i >> 2, last.first.j >> 2};
    const Cell high{(last.first.i + last.width + kCoarser - 1) >> 2,
                    (last.first.j + last.height + kCoarser - 1) >> 2};
    Raster coarse;
    coarse.level = last.level;
    coarse.level.cell_m *= kCoarser;
    coarse.first = low;
    coarse.width = high.i - low.i;
    coarse.height = high.j - low.j;
    coarse.z_m.assign(coarse.cells(), std::numeric_limits<float>::quiet_NaN());
    paste_coarser(cut(last, {kCoarser * low.i, kCoarser * low.j}, kCoarser * coarse.width,
                      kCoarser * coarse.height),
                  &coarse);
    levels.push_back(std::move(coarse));
  }
  return levels;
}

}  // namespace rcs::mapping
