#pragma once
// Ground between two places that a LADAR sees in one direction: merely between its rows, or hidden
// by an edge at the near one. Behind an edge the ground is lower than the extrapolated near side.
// From the range R and the height h, only h w / R of the depth of a ditch of width w is visible.

#include <algorithm>
#include <cmath>

namespace rcs::wm {

struct HiddenGapParams {
  /// Behind an edge the far place is lower than the extrapolated near side by more than this, plus
  /// what max_curvature explains and `sigmas` standard deviations of the extrapolation. Bumps and
  /// grass before a gap make the extrapolation uncertain.
  double deficit_m = 0.08;
  double max_curvature = 0.03;  ///< of ground that can be driven over, convex [1/m]
  double sigmas = 3.0;          ///< of the extrapolation
  double shortest_m = 0.4;      ///< a shorter gap stops no wheel
  double longest_m = 6.0;
};

struct HiddenGap {
  int cells = 0;        ///< unseen cells between the two places; 0: they are neighbours, or no near
                        ///< place or not enough of its side is known
  bool hidden = false;  ///< by an edge
  bool clearly = false;  ///< the deficit is twice what it must be
};

/// @param height_at  number of steps from the far place (0) towards the LADAR -> float height [m],
/// NAN where nothing was seen
/// @param step_m  between two of them, about a cell
template <typename HeightAt>
[[nodiscard]] HiddenGap hidden_gap(HeightAt&& height_at, double step_m,
                                   const HiddenGapParams& params) {
  constexpr double kNearSide_m = 1.6;  // whose slope continues
  constexpr double kBasis_m = 0.5;     // at least, that defines a slope
  constexpr double kSteepest = 0.7;
  constexpr double kNoise_m2 = 1e-4;  // variance of a height, at least
  const float far_m = height_at(0);
  const int most = static_cast<int>(params.longest_m / step_m);
  int near = 1;
  while (near <= most && std::isnan(height_at(near))) ++near;
  HiddenGap out;
  if (near > most || near == 1) return out;
  // The line through the near side, with d the distance from the near place to the LADAR.
  double n = 0.0, d1 = 0.0, d2 = 0.0, z1 = 0.0, dz = 0.0, z2 = 0.0;
  double basis_m = 0.0;
  for (int k = near; (k - near) * step_m <= kNearSide_m; ++k) {
    const double z = height_at(k);
    if (std::isnan(z)) continue;
    const double d = (k - near) * step_m;
    n += 1.0;
    d1 += d;
    d2 += d * d;
    z1 += z;
    dz += d * z;
    z2 += z * z;
    basis_m = d;
  }
  if (basis_m < kBasis_m) return out;
  const double sdd = d2 - d1 * d1 / n;
  const double sdz = dz - d1 * z1 / n;
  const double slope = sdz / sdd;  // rise towards the LADAR
  if (std::abs(slope) > kSteepest) return out;
  out.cells = near - 1;
  const double gap_m = near * step_m;
  const double continued_m = (z1 - slope * d1) / n - slope * gap_m;
  // Standard error of a prediction by a least-squares line, far from its points.
  const double residuals = std::max(0.0, z2 - z1 * z1 / n - slope * sdz);
  const double variance = kNoise_m2 + (n > 2.0 ? residuals / (n - 2.0) : 0.0);
  const double away_m = gap_m + d1 / n;
  const double sigma_m = std::sqrt(variance * (1.0 + 1.0 / n + away_m * away_m / sdd));
  const double limit_m =
      params.deficit_m + 0.5 * params.max_curvature * gap_m * gap_m + params.sigmas * sigma_m;
  out.hidden = out.cells * step_m >= params.shortest_m && continued_m - far_m > limit_m;
  out.clearly = out.hidden && continued_m - far_m > 2.0 * limit_m;
  return out;
}

}  // namespace rcs::wm
