#pragma once
// Planes through 5 x 5 neighbourhoods of terrain cells by least squares, four neighbourhoods in a
// row at once.

#include <Eigen/Dense>
#include <cstddef>

#include "modules/wm/terrain/terrain_grid.h"

namespace rcs::wm {

inline constexpr int kFewest = 6;  // known cells that define a plane
inline constexpr int kLanes = 4;   // neighbours in a row whose planes are fitted at once
using Lanes = Eigen::Array<double, kLanes, 1>;

// Moments of five values `stride` apart about the middle one, for kLanes of them.
struct Moments {
  Lanes zeroth, first, second;
};

inline Moments moments(const double* middle, std::ptrdiff_t stride) {
  const auto at = [&](int k) -> Lanes { return Eigen::Map<const Lanes>(middle + k * stride); };
  const Lanes inner = at(1) + at(-1);
  const Lanes outer = at(2) + at(-2);
  return {at(0) + inner + outer, at(1) - at(-1) + 2.0 * (at(2) - at(-2)), inner + 4.0 * outer};
}

// Moments along y of each column of five cells, next to each other, to be added along x.
enum Column { kN, kY, kYy, kZ, kYz, kZz, kColumns };

// Least squares over the known cells of kLanes neighbourhoods.
struct PlaneFits {
  Lanes n;  // known cells
  /// 0: the cells lie on a line or are too few, and the other members are meaningless.
  Lanes found = Lanes::Zero();
  Lanes a, b, c, slope_rad, rms, leverage;

  [[nodiscard]] GroundPlane plane(int k) const {
    return {a[k], b[k], c[k], slope_rad[k], rms[k], leverage[k]};
  }
};

// For tangents from 0 on, within 1e-5 rad (Abramowitz and Stegun, 4.4.47). The function of libm
// took a fifth of the time of a patch.
inline Lanes arc_tangent(const Lanes& tangent) {
  const Lanes x = tangent.min(1.0 / tangent);
  const Lanes x2 = x * x;
  const Lanes angle =
      x * (0.9998660 + x2 * (-0.3302995 + x2 * (0.1801410 + x2 * (-0.0851330 + x2 * 0.0208351))));
  return (tangent > 1.0).select(0.5 * kPi - angle, angle);
}

// @param middle  centre of the neighbourhoods in the moments of the columns
// @param stride  from one moment of a column to the next
inline PlaneFits fit_planes(const double* middle, std::ptrdiff_t stride, double cell_m) {
  const Moments of_n = moments(middle + kN * stride, 1);
  PlaneFits fits;
  fits.n = of_n.zeroth;
  if ((fits.n < kFewest).all()) return fits;
  const Moments of_y = moments(middle + kY * stride, 1);
  const Moments of_z = moments(middle + kZ * stride, 1);
  const Lanes syy = moments(middle + kYy * stride, 1).zeroth;
  const Lanes syz = moments(middle + kYz * stride, 1).zeroth;
  const Lanes szz = moments(middle + kZz * stride, 1).zeroth;
  const Lanes& sx = of_n.first;
  const Lanes& sy = of_y.zeroth;
  const Lanes& sz = of_z.zeroth;
  const Lanes n = of_n.zeroth.max(1.0);
  const Lanes per_n = 1.0 / n;  // divisions dominate the time of a plane
  const Lanes mx = sx * per_n;
  const Lanes my = sy * per_n;
  const Lanes mz = sz * per_n;
  const Lanes cxx = of_n.second - sx * mx;
  const Lanes cxy = of_y.first - sx * my;
  const Lanes cyy = syy - sy * my;
  const Lanes cxz = of_z.first - sx * mz;
  const Lanes cyz = syz - sy * mz;
  const Lanes czz = szz - sz * mz;
  const Lanes det = cxx * cyy - cxy * cxy;
  const Lanes per_det = 1.0 / det;
  fits.found = (n >= kFewest && det >= 0.5 * n).cast<double>();
  fits.b = (cyy * cxz - cxy * cyz) * per_det;
  fits.c = (cxx * cyz - cxy * cxz) * per_det;
  fits.slope_rad = arc_tangent((fits.b * fits.b + fits.c * fits.c).sqrt() / cell_m);
  fits.a = mz - fits.b * mx - fits.c * my;
  fits.rms = ((czz - fits.b * cxz - fits.c * cyz).max(0.0) * per_n).sqrt();
  fits.leverage = per_n + (cyy * mx * mx - 2.0 * cxy * mx * my + cxx * my * my) * per_det;
  return fits;
}

}  // namespace rcs::wm
