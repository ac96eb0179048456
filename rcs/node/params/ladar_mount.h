#pragma once
// Where the LADAR is, for the nodes that read it.

#include "rcs/base/pose.h"
#include "rcs/node/params/params.h"

namespace rcs {

/// @param ladar  the table [ladar]
inline void read_ladar_mount(ParamTable ladar, Pose* T_vehicle_mount) {
  ladar.get_pose("mount", T_vehicle_mount, {-20, 20},
                 "Pose of the LADAR's pan/tilt head at pan = tilt = 0 in the vehicle frame (x "
                 "ahead, y left, z up).");
}

}  // namespace rcs
