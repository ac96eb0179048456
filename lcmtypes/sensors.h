#pragma once
// The channels of the vehicle's sensors: all of a recording that may reach nodes again. Commands
// and the nodes' own outputs are never played back.

#include <array>

#include "lcmtypes/channels.h"

namespace rcs::channel {

inline constexpr std::array<const char*, 5> kSensors = {kLadarRanges, kLadarPoints, kIns, kGpsFix,
                                                        kOdometry};

}  // namespace rcs::channel
