#pragma once
// Export of maps as GeoTIFF and images.

#include <string>

#include "rcs/base/result.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/raster.h"

namespace rcs::survey {

/// All of a level's tiles as one raster.
/// @return an error if it has more than 2^28 cells
[[nodiscard]] Result<Raster> whole_level(const MapFolder& map, int level);

/// The finest level with at most so many cells in its bounding rectangle, else the coarsest.
[[nodiscard]] int level_of_at_most(const MapFolder& map, std::int64_t cells);

/// Heights above the ellipsoid, sigma, count, date and source as five bands, in the orthographic
/// projection about the datum of the map, in its reference frame: the horizontal error is
/// x * h / 6.4e6 for ground that is h above the datum. A map in a local frame (heights not above
/// the ellipsoid) keeps its z.
[[nodiscard]] Outcome write_geotiff(const MapFrame& frame, const Raster& raster,
                                    const std::string& path);

/// Hillshade, lit from the north-west, as PNG.
[[nodiscard]] Outcome write_hillshade(const Raster& raster, const std::string& path);

}  // namespace rcs::survey
