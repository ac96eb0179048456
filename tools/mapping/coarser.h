#pragma once
// The same ground on a coarser lattice.

#include <vector>

#include "rcs/terrain/raster.h"

namespace rcs::mapping {

constexpr int kCoarser = 4;  ///< cells of the finer lattice along one of the coarser

/// Puts the means of 4 x 4 cells of `fine` into the cells of `coarse` that they make up. A cell of
/// which less than half is known stays unknown. A mean's sigma is that of the ground beside the
/// interpolated surface: the fine cells' own, and what they deviate from a plane by.
/// @param fine  its first cell's numbers are multiples of 4
/// @param coarse  on the same origin; holds the cells; its layers but the heights are spread
void paste_coarser(const Raster& fine, Raster* coarse);

/// A raster with its coarser levels, the finest first, until one is less than a tile wide.
[[nodiscard]] std::vector<Raster> with_coarser_levels(Raster finest);

}  // namespace rcs::mapping
