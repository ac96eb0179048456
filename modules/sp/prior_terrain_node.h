#pragma once
// The a priori map as SP has it: in memory around the vehicle, and where it lies in frame world.

#include <memory>
#include <optional>

#include "modules/sp/sp_config.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/report.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

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

/// Opens the map that the configuration names; none when it names none.
/// @param live  tiles come by a thread; else, as in a replay, when they are asked for
[[nodiscard]] Result<PriorTerrain> open_prior_terrain(const SpConfig& config, bool live);

}  // namespace rcs::sp
