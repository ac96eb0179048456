#pragma once
// The a priori map as a node has it: in memory around a place, and where it lies in frame world.

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
  std::string reference_frame = "WGS84";  ///< of the GPS' fixes, and so of the map
};

/// Reads the map's keys of [world].
[[nodiscard]] PriorTerrainParams read_prior_terrain(const ParamFile& file);

class PriorTerrain {
 public:
  PriorTerrain() = default;  ///< none
  /// @param loader  brings the tiles; null: all of the map is in memory
  PriorTerrain(ElevationMap map, std::unique_ptr<TileLoader> loader);

  [[nodiscard]] bool there() const { return map_.has_value(); }
  [[nodiscard]] const ElevationMap& map() const { return *map_; }

  /// Frame world has its origin there.
  void set_datum(const Geodetic& datum);
  [[nodiscard]] const std::optional<Pose>& T_map_world() const { return T_map_world_; }

  /// The same by a place in the map's frame.
  void follow_in_map(const Vec2& p_map, Stamp now, Report* report);
  /// Reads ahead around the vehicle; what can't be read is reported.
  void follow(const Vec3& p_world, Stamp now, Report* report);

 private:
  std::optional<ElevationMap> map_;
  std::unique_ptr<TileLoader> loader_;  // gone before the slots that it writes to
  std::optional<Pose> T_map_world_;
  Geodetic datum_;
  MapLoading told_;
};

/// Opens the map; none when none is named.
/// @param live  tiles come by a thread; else, as in a replay, when they are asked for
[[nodiscard]] Result<PriorTerrain> open_prior_terrain(const PriorTerrainParams& params, bool live);

}  // namespace rcs
