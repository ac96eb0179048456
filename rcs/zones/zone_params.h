#pragma once
// The zones of a vehicle's configuration.

#include "rcs/node/params/params.h"
#include "rcs/zones/zone_file.h"

namespace rcs {

/// Reads [world] zones and the file that it names; none: no zones. An error of the file is an error
/// of the key, which ParamFile::finish() returns.
[[nodiscard]] GeodeticZones read_zones(const ParamFile& file);

}  // namespace rcs
