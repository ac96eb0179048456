#pragma once
// Edges in the ground: ledges, drops and the sides of ditches.

#include <algorithm>
#include <array>
#include <cmath>

namespace rcs::wm {

/// Heights of five cells in a row [m], NAN where the ground is unknown; the cell in question is the
/// middle one.
using Profile = std::array<float, 5>;

/// Height of the largest edge between the middle cell and its neighbours, or across it, beyond what
/// continues the slope of the ground before or after it [m]. A slope that begins or ends, a crest
/// and a hollow are none.
/// @param rise_m  of the ground from cell to cell along the profile, where no slope is known
[[nodiscard]] inline double ledge_height(const Profile& z_m, double rise_m) {
  // From cell `a` to cell `b`: the slope before is that of the cell before `a`.
  const auto beyond = [&](std::size_t a, std::size_t b) {
    const float edge_m = z_m[b] - z_m[a];
    if (std::isnan(edge_m)) return 0.0F;
    const float before_m = a > 0 ? z_m[a] - z_m[a - 1] : std::nanf("");
    const float after_m = b < 4 ? z_m[b + 1] - z_m[b] : std::nanf("");
    float slope_m = std::isnan(before_m) && std::isnan(after_m) ? static_cast<float>(rise_m) : 0.0F;
    if (edge_m < 0.0F) slope_m = -slope_m;
    for (const float other_m : {before_m, after_m}) {
      slope_m = std::fmax(slope_m, edge_m < 0.0F ? -other_m : other_m);  // NAN: the other argument
    }
    return std::abs(edge_m) - static_cast<float>(b - a) * std::max(0.0F, slope_m);
  };
  return std::max({0.0F, beyond(2, 3), beyond(1, 2), beyond(1, 3)});
}

}  // namespace rcs::wm
