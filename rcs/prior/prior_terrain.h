#pragma once
// The a priori map of a node: in memory around a position, and its pose relative to frame world.

#include <memory>
#include <optional>
#include <string>

#include "rcs/base/geodesy.h"
#include "rcs/node/params/params.h"
#include "rcs/node/report.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs {

struct PriorTerrainParams {
  std::string map;                        ///< its folder; empty: none
  MapWindow window;                       ///< prior_map_radius_m, prior_map_memory_mb
  std::string reference_frame = "WGS84";  ///< of the GPS fixes, and hence of the map
};

/// Reads the map's keys of [world].
[[nodiscard]] PriorTerrainParams read_prior_terrain(const ParamFile& file);

class PriorTerrain {
 public:
  PriorTerrain() = default;  ///< no map
  /// @param loader  loads the tiles; null: all of the map is in memory
  PriorTerrain(ElevationMap map, std::unique_ptr<TileLoader> loader);

  [[nodiscard]] bool there() const { return map_.has_value(); }
  [[nodiscard]] const ElevationMap& map() const { return *map_; }

  /// Sets the origin of frame world.
  void set_datum(const Geodetic& datum);
  [[nodiscard]] const std::optional<Pose>& T_map_world() const { return T_map_world_; }

  /// Loads tiles around a position in the map's frame; failures are reported.
  void follow_in_map(const Vec2& p_map, Stamp now, Report* report);
  /// The same around a position in frame world.
  void follow(const Vec3& p_world, Stamp now, Report* report);

 private:
  std::optional<ElevationMap> map_;
  std::unique_ptr<TileLoader> loader_;  // destroyed before the slots that it writes to
  std::optional<Pose> T_map_world_;
  Geodetic datum_;
  std::int64_t told_failed_ = 0;
};

/// Opens the map; no map if none is configured.
/// @param live  a thread loads the tiles; else, as in a replay, they are loaded when requested
[[nodiscard]] Result<PriorTerrain> open_prior_terrain(const PriorTerrainParams& params, bool live);

}  // namespace rcs
