#include "rcs/zones/zone_params.h"

#include <utility>

namespace rcs {

std::string read_zones_key(const ParamFile& file) {
  ParamTable world = file.root().table("world");
  std::string path;
  world.get(
      "zones", &path,
      "GeoJSON file of the operating zones (fence, keep_out, speed, road), relative to this file. "
      "With a fence or a keep-out the vehicle does not move while its protection level in "
      "frame world is unbounded. Empty: no zones.");
  return path.empty() ? path : file.resolve(path);
}

GeodeticZones read_zones(const ParamFile& file) {
  const std::string path = read_zones_key(file);
  if (path.empty()) return {};
  Result<GeodeticZones> zones = load_zones(path);
  if (zones) return std::move(zones).value();
  file.root().table("world").fail("zones", zones.error().message);
  return {};
}

}  // namespace rcs
