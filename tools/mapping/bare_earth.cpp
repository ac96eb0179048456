#include "tools/mapping/bare_earth.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace rcs::mapping {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr float kHighest = std::numeric_limits<float>::infinity();

/// The minimum of each window of 2 r + 1 along a line, three comparisons per value (van Herk,
/// 1992).
class LineFilter {
 public:
  /// @param at  n values, `stride` apart
  void least(float* at, int n, std::ptrdiff_t stride, int r) {
    const int wide = 2 * r + 1;
    const int blocks = (n + 2 * r + wide - 1) / wide;
    const auto size = static_cast<std::size_t>(blocks) * static_cast<std::size_t>(wide);
    value_.assign(size, kHighest);
    for (int k = 0; k < n; ++k) value_[static_cast<std::size_t>(k + r)] = at[k * stride];
    forth_ = value_;
    back_ = value_;
    for (std::size_t k = 1; k < size; ++k) {
      if (k % static_cast<std::size_t>(wide) == 0) continue;
      forth_[k] = std::min(forth_[k], forth_[k - 1]);
    }
    for (std::size_t k = size - 1; k > 0; --k) {
      if (k % static_cast<std::size_t>(wide) == 0) continue;
      back_[k - 1] = std::min(back_[k - 1], back_[k]);
    }
    for (int k = 0; k < n; ++k) {
      at[k * stride] =
          std::min(back_[static_cast<std::size_t>(k)], forth_[static_cast<std::size_t>(k + 2 * r)]);
    }
  }

 private:
  std::vector<float> value_, forth_, back_;
};

/// The minimum in the square around each cell.
void erode(std::vector<float>* z, int width, int height, int r) {
  LineFilter line;
  for (int j = 0; j < height; ++j) {
    line.least(z->data() + static_cast<std::ptrdiff_t>(j) * width, width, 1, r);
  }
  for (int i = 0; i < width; ++i) line.least(z->data() + i, height, width, r);
}

/// Morphological opening of z by squares of that size; infinite: no cell is near.
std::vector<float> opened(const std::vector<float>& z, int width, int height, int r) {
  std::vector<float> out = z;
  erode(&out, width, height, r);
  for (float& v : out) v = v == kHighest ? kHighest : -v;
  erode(&out, width, height, r);
  for (float& v : out) v = v == kHighest ? kHighest : -v;
  return out;
}

/// Flags cells above the opened surface by more than the slope allows, with growing windows.
std::vector<std::uint8_t> standing(std::vector<float> z, int width, int height, double slope,
                                   double cell_m, int most) {
  std::vector<std::uint8_t> is_standing(z.size(), 0);
  for (int r = 1; r <= most; ++r) {
    std::vector<float> next = opened(z, width, height, r);
    const auto allowed = static_cast<float>(slope * r * cell_m);
    for (std::size_t k = 0; k < z.size(); ++k) {
      if (z[k] != kHighest && z[k] - next[k] > allowed) is_standing[k] = 1;
      if (z[k] == kHighest) next[k] = kHighest;
    }
    z = std::move(next);
  }
  return is_standing;
}

/// Half resolution: means of the known cells.
Raster halved(const Raster& fine) {
  Raster out;
  out.level = fine.level;
  out.width = (fine.width + 1) / 2;
  out.height = (fine.height + 1) / 2;
  out.z_m.assign(out.cells(), kUnknown);
  for (int j = 0; j < out.height; ++j) {
    for (int i = 0; i < out.width; ++i) {
      double sum = 0.0;
      int n = 0;
      for (int b = 2 * j; b < std::min(2 * j + 2, fine.height); ++b) {
        for (int a = 2 * i; a < std::min(2 * i + 2, fine.width); ++a) {
          const float z = fine.z_m[fine.at({fine.first.i + a, fine.first.j + b})];
          if (std::isnan(z)) continue;
          sum += z;
          ++n;
        }
      }
      if (n > 0) out.z_m[out.at({i, j})] = static_cast<float>(sum / n);
    }
  }
  return out;
}

/// Relaxes the unknown cells towards the mean of their neighbours, row by row.
void relax(const std::vector<std::size_t>& unknown, Raster* surface) {
  constexpr int kRounds = 8;  // starting from the coarser surface
  const auto width = static_cast<std::size_t>(surface->width);
  std::vector<float>& z = surface->z_m;
  for (int round = 0; round < kRounds; ++round) {
    for (const std::size_t k : unknown) {
      const std::size_t i = k % width;
      float sum = 0.0F;
      int n = 0;
      const auto add = [&](bool there, std::size_t at) {
        if (!there) return;
        sum += z[at];
        ++n;
      };
      add(i > 0, k - 1);
      add(i + 1 < width, k + 1);
      add(k >= width, k - width);
      add(k + width < z.size(), k + width);
      if (n > 0) z[k] = sum / static_cast<float>(n);
    }
  }
}

}  // namespace

void lower(Raster* lowest, const Vec3& p) {
  const Cell c = lowest->level.cell_at(p.x(), p.y());
  if (!lowest->contains(c)) return;
  float& z = lowest->z_m[lowest->at(c)];
  if (!(z <= p.z())) z = static_cast<float>(p.z());
}

Raster bare_earth(const Raster& lowest, const BareEarthParams& params) {
  const double cell_m = lowest.level.cell_m;
  std::vector<float> z = lowest.z_m;
  for (float& v : z) v = std::isnan(v) ? kHighest : v;
  // Points far below: objects on the inverted ground, by a slope of 500 %.
  constexpr double kSteepest = 5.0;
  std::vector<float> turned = z;
  for (float& v : turned) v = v == kHighest ? kHighest : -v;
  const std::vector<std::uint8_t> sunk =
      standing(std::move(turned), lowest.width, lowest.height, kSteepest, cell_m, 1);
  for (std::size_t k = 0; k < z.size(); ++k) z[k] = sunk[k] != 0 ? kHighest : z[k];
  const int most = std::max(1, static_cast<int>(std::ceil(params.largest_m / cell_m)));
  const std::vector<std::uint8_t> objects =
      standing(z, lowest.width, lowest.height, params.slope, cell_m, most);
  Raster out = lowest;
  for (std::size_t k = 0; k < z.size(); ++k) {
    if (z[k] == kHighest || objects[k] != 0) out.z_m[k] = kUnknown;
  }
  return out;
}

Raster bridged(const Raster& heights) {
  std::vector<std::size_t> unknown;
  for (std::size_t k = 0; k < heights.z_m.size(); ++k) {
    if (std::isnan(heights.z_m[k])) unknown.push_back(k);
  }
  Raster out = heights;
  if (unknown.empty() || heights.cells() == 1) return out;
  const Raster coarse = bridged(halved(heights));
  for (const std::size_t k : unknown) {
    const auto i = static_cast<int>(k % static_cast<std::size_t>(out.width));
    const auto j = static_cast<int>(k / static_cast<std::size_t>(out.width));
    out.z_m[k] = coarse.z_m[coarse.at({i / 2, j / 2})];
  }
  relax(unknown, &out);
  return out;
}

Raster smoothed(const Raster& surface) {
  Raster out = surface;
  const auto at = [&surface](int i, int j) {
    i = std::clamp(i, 0, surface.width - 1);
    j = std::clamp(j, 0, surface.height - 1);
    return surface.z_m[surface.at({surface.first.i + i, surface.first.j + j})];
  };
  const auto across = [&at](int i, int j) {
    return 0.25F * at(i - 1, j) + 0.5F * at(i, j) + 0.25F * at(i + 1, j);
  };
  for (int j = 0; j < surface.height; ++j) {
    for (int i = 0; i < surface.width; ++i) {
      out.z_m[out.at({out.first.i + i, out.first.j + j})] =
          0.25F * across(i, j - 1) + 0.5F * across(i, j) + 0.25F * across(i, j + 1);
    }
  }
  return out;
}

SurfaceHere surface_at(const Raster& surface, double x_m, double y_m) {
  const MapLevel& level = surface.level;
  const auto along = [&](double v, double origin, int first, int n, int* index) {
    const double u =
        std::clamp((v - origin) / level.cell_m - first - 0.5, 0.0, static_cast<double>(n - 1));
    *index = std::min(static_cast<int>(u), std::max(0, n - 2));
    return u - *index;
  };
  int i = 0;
  int j = 0;
  const double s = along(x_m, level.origin_m.x(), surface.first.i, surface.width, &i);
  const double t = along(y_m, level.origin_m.y(), surface.first.j, surface.height, &j);
  const auto at = [&](int a, int b) -> double {
    const Cell c{surface.first.i + std::min(i + a, surface.width - 1),
                 surface.first.j + std::min(j + b, surface.height - 1)};
    return surface.z_m[surface.at(c)];
  };
  const double south = at(0, 0) + s * (at(1, 0) - at(0, 0));
  const double north = at(0, 1) + s * (at(1, 1) - at(0, 1));
  SurfaceHere here;
  here.z_m = south + t * (north - south);
  here.gradient = Vec2((1 - t) * (at(1, 0) - at(0, 0)) + t * (at(1, 1) - at(0, 1)), north - south) /
                  level.cell_m;
  return here;
}

}  // namespace rcs::mapping
