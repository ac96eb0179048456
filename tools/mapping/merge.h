#pragma once
// Several surveys of the same ground as one.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// Heights that differ by more than so many of their standard deviations are not of one ground.
constexpr double kChangedSigmas = 4.0;

struct Fused {
  Raster raster;
  std::int64_t several = 0;  ///< cells that more than one survey knows
  std::int64_t changed = 0;  ///< of them those where the surveys contradict each other
};

/// The mean of surveys, cell by cell, by the inverse of their variances: sigma squared, and the
/// square of the survey's slow error, which is independent between surveys. Counts add up, the date
/// is the newest, a source that is not all's is kMixed.
///
/// Where surveys contradict each other the ground has changed, or one is wrong: the newest is
/// believed (the surest, where dates are equal or one is not known; the lower where that is equal,
/// too: what stands on the ground lifts a survey), with those that agree with it.
///
/// The level's bias is one number for all cells: the largest of the surveys', as that is what
/// cells have which this survey alone knows. A fused cell's own is smaller.
/// The result does not depend on the order of the surveys.
/// @param surveys  at least one; the same cells of the same lattice, each with its own bias
[[nodiscard]] Fused fuse(const std::vector<Raster>& surveys);

struct Merged {
  MapFrame frame;
  double cell_m = 0.0;
  std::int64_t cells = 0;  ///< known, of the finest level
  std::int64_t several = 0;
  std::int64_t changed = 0;
  std::int64_t points_lost = 0;  ///< of what stands on the ground: it is not merged
};

/// Fuses maps in the frame and on the finest lattice of the first; of the others what covers it
/// and what lies beside. Works tile by tile. `out` may be one of the maps.
/// @param maps  at least two, none twice: a survey that is asked twice is not twice as sure
/// @param progress  is told the share done, [0, 1]; says whether to go on
/// @return an error for maps of different reference frames or kinds of heights, and for more than
///   4 million tiles
[[nodiscard]] Result<Merged> merge_maps(const std::vector<std::string>& maps,
                                        const std::string& out,
                                        const std::function<bool(double)>& progress);

struct Filled {
  std::int64_t cells = 0;   ///< known, of the finest level
  std::int64_t filled = 0;  ///< of them those that the prior map knew alone
};

/// A map whose unknown cells are another's, in those tiles that it has. What it knows stays as it
/// is; the other's cells keep count, date and source, and their sigma takes in the other's slow
/// error, as the level's is the map's own. `out` may be one of the maps.
/// @param progress  as merge_maps()
/// @return an error for maps of different reference frames or kinds of heights
[[nodiscard]] Result<Filled> fill_map(const std::string& map, const std::string& prior,
                                      const std::string& out,
                                      const std::function<bool(double)>& progress);

}  // namespace rcs::mapping
