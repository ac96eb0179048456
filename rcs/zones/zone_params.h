#pragma once
// The zones of a vehicle's configuration.

#include <string>

#include "rcs/node/params/params.h"
#include "rcs/zones/zone_file.h"

namespace rcs {

/// Reads [world] zones only: the path of the file, or empty. For a program that checks the keys of
/// [world] and does not use zones.
std::string read_zones_key(const ParamFile& file);

/// Reads [world] zones and the file that it names; none: no zones. An error of the file is an error
/// of the key, which ParamFile::finish() returns.
[[nodiscard]] GeodeticZones read_zones(const ParamFile& file);

}  // namespace rcs
