#include "rcs/prior/prior_terrain.h"

#include <utility>

#include "lcmtypes/events.h"
#include "rcs/prior/async_tile_loader.h"

namespace rcs {

PriorTerrainParams read_prior_terrain(const ParamFile& file) {
  constexpr double kMegabyte = 1048576.0;
  PriorTerrainParams p;
  ParamTable world = file.root().table("world");
  world.get("prior_map", &p.map,
            "Folder of the a priori elevation map, relative to this file. Empty: no map.");
  world.get("prior_map_radius_m", &p.window.radius_m, {10, 1e5},
            "Radius around the vehicle within which tiles of the a priori map are kept in memory.");
  double memory_mb = p.window.memory_bytes / kMegabyte;
  world.get("prior_map_memory_mb", &memory_mb, {1, 1e5},
            "Largest memory for tiles of the a priori map (2^20 bytes); a map that needs more "
            "within the radius is rejected at the start.");
  p.window.memory_bytes = memory_mb * kMegabyte;
  world.get("reference_frame", &p.reference_frame,
            "Reference frame of the GPS fixes, such as WGS84. An a priori map in another frame is "
            "rejected at the start.");
  if (!p.map.empty()) p.map = file.resolve(p.map);
  return p;
}

PriorTerrain::PriorTerrain(ElevationMap map, std::unique_ptr<TileLoader> loader)
    : map_(std::move(map)), loader_(std::move(loader)) {}

void PriorTerrain::set_datum(const Geodetic& datum) {
  const bool same = T_map_world_ && datum.lat_rad == datum_.lat_rad &&
                    datum.lon_rad == datum_.lon_rad && datum.height.m == datum_.height.m;
  if (same || !map_) return;
  T_map_world_ = LocalFrame(map_->datum()).from(LocalFrame(datum));
  datum_ = datum;
}

void PriorTerrain::follow(const Vec3& p_world, Stamp now, Report* report) {
  if (T_map_world_) follow_in_map((*T_map_world_ * p_world).head<2>(), now, report);
}

void PriorTerrain::follow_in_map(const Vec2& p_map, Stamp now, Report* report) {
  if (!map_ || !loader_) return;
  map_->follow(p_map, loader_.get());
  const MapLoading& l = map_->loading();
  if (l.failed <= told_failed_) return;
  told_failed_ = l.failed;
  report->publish(now, event::kMapTileFailed, "{}; the ground there is unknown ({} tiles so far)",
                  l.failure, l.failed);
}

Result<PriorTerrain> open_prior_terrain(const PriorTerrainParams& params, bool live) {
  if (params.map.empty()) return PriorTerrain();
  Result<ElevationMap> map = ElevationMap::open(params.map, params.window);
  if (!map) return map.error();
  if (Outcome fits = check_frame(map->frame(), params.reference_frame); !fits) {
    return Error{params.map + ": " + fits.error().message};
  }
  std::unique_ptr<TileLoader> loader;
  if (live) {
    loader = std::make_unique<AsyncTileLoader>(params.map);
  } else {
    loader = std::make_unique<DirectTileLoader>(params.map);
  }
  return PriorTerrain(std::move(map).value(), std::move(loader));
}

}  // namespace rcs
