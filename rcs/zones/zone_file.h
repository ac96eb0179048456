#pragma once
// Zones from a GeoJSON file (RFC 7946), as QGIS writes it.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "rcs/zones/zones.h"

namespace rcs {

/// Zones as they were drawn. They are kept in degrees, because frame world has no origin before the
/// first fix, and may get another one.
struct GeodeticZones {
  std::string file;
  std::vector<Zone> zones;  ///< vertices: longitude, latitude [deg], WGS84

  [[nodiscard]] bool empty() const { return zones.empty(); }
  /// @param world  the frame; vertices are projected to its plane at the height of its datum. Those
  ///   that are more than 200 km away keep their distance instead, so that the other side of the
  ///   earth is not projected onto the datum.
  [[nodiscard]] Zones in_world(const LocalFrame& world) const;
};

constexpr std::size_t kMaxZoneFileBytes = 10'000'000;
/// Of all zones of a file, after edges longer than 1 km have been divided: RFC 7946 draws them
/// straight in longitude and latitude, where 10 km deviate by 2 m from a line in frame world.
constexpr std::size_t kMaxZoneVertices = 20'000;
constexpr std::size_t kMaxFencePolygons = 32;

/// Reads a FeatureCollection of polygons and multipolygons. Properties of a feature: `kind`
/// ("fence", "keep_out", "speed" or "road"), `name`, and `speed_mps` of a speed zone and of a road;
/// others are ignored.
/// @return an error names the file, the feature by its number and name, the key and what is allowed
[[nodiscard]] Result<GeodeticZones> parse_zones(std::string_view text, const std::string& file);

/// The same, of a regular file.
[[nodiscard]] Result<GeodeticZones> load_zones(const std::string& path);

}  // namespace rcs
