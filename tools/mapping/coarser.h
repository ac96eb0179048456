#pragma once
// The same ground on a coarser lattice.

#include <vector>

#include "rcs/terrain/raster.h"

namespace rcs::mapping {

constexpr int kCoarser = 4;  ///< cells of the finer lattice along one of the coarser

/// Writes the means of 4 x 4 cells of `fine` to the cells of `coarse`. A cell of which less than
/// half is known stays unknown. The sigma of a mean is that of the ground against the interpolated
/// surface: the sigmas of the fine cells and their deviation from a plane.
/// @param fine  the indices of its first cell are multiples of 4
/// @param coarse  same origin; contains the cells; its layers other than heights are full arrays
void paste_coarser(const Raster& fine, Raster* coarse);

/// A raster with its coarser levels, the finest first, until one is less than a tile wide.
[[nodiscard]] std::vector<Raster> with_coarser_levels(Raster finest);

}  // namespace rcs::mapping
