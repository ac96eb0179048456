#pragma once
// Merges several surveys of the same ground.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// Heights that differ by more than so many standard deviations contradict each other.
constexpr double kChangedSigmas = 4.0;

struct Fused {
  Raster raster;
  std::int64_t several = 0;  ///< cells known to more than one survey
  std::int64_t changed = 0;  ///< of them those where the surveys contradict each other
};

/// The mean of surveys, cell by cell, weighted by their inverse variances: sigma squared plus the
/// variance of the systematic error, which is independent between surveys. Counts are added, the
/// date is the newest, different sources become kMixed.
///
/// If surveys contradict each other, the ground has changed or one is wrong: the newest is used
/// (for equal or unknown dates that with the smallest variance; for equal variances the lower one,
/// because above-ground structure raises heights), with those that agree with it.
///
/// The bias of the level is one number for all cells: the largest of the surveys, which holds for
/// cells known to that survey alone. That of a fused cell is smaller.
/// The result does not depend on the order of the surveys.
/// @param surveys  at least one; the same cells of the same lattice, each with its own bias
[[nodiscard]] Fused fuse(const std::vector<Raster>& surveys);

struct Merged {
  MapFrame frame;
  double cell_m = 0.0;
  std::int64_t cells = 0;  ///< known, of the finest level
  std::int64_t several = 0;
  std::int64_t changed = 0;
  std::int64_t points_lost = 0;  ///< surface points, which are not merged
};

/// Merges maps in the frame and on the finest lattice of the first, over the union of their areas.
/// Works tile by tile. `out` may be one of the maps.
/// @param maps  at least two, none twice, because surveys must be independent
/// @param progress  called with the completed share, [0, 1]; returns false to stop
/// @return an error for maps of different reference frames or kinds of heights, and for more than
///   4 million tiles
[[nodiscard]] Result<Merged> merge_maps(const std::vector<std::string>& maps,
                                        const std::string& out,
                                        const std::function<bool(double)>& progress);

struct Filled {
  std::int64_t cells = 0;   ///< known, of the finest level
  std::int64_t filled = 0;  ///< of them those from the prior map
};

/// Fills the unknown cells of the tiles of a map from another map. Known cells are unchanged;
/// filled cells keep count, date and source, and their sigma includes the systematic error of the
/// other map, because the level has that of the first. `out` may be one of the maps.
/// @param progress  as merge_maps()
/// @return an error for maps of different reference frames or kinds of heights
[[nodiscard]] Result<Filled> fill_map(const std::string& map, const std::string& prior,
                                      const std::string& out,
                                      const std::function<bool(double)>& progress);

}  // namespace rcs::mapping
