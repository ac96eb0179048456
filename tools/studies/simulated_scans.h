#pragma once
// Scans of the simulated range imager, whose motion is known exactly.

#include "modules/sp/scan/range_image.h"
#include "sim/scenario.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::studies {

/// The scenario's range imager, whose points are in the frame of its mount.
[[nodiscard]] sp::LadarParams ladar_in_mount(const sim::Scenario& scenario);
/// An error would be the same in all scans, and none of the motion between them.
[[nodiscard]] sim::MountParams without_error(sim::MountParams mount);

/// Scans k, k + 1 and k + 20 of a scripted drive, `models` times, evenly over the drive. Each is
/// made of ranges as sp makes it (mixed pixels left out) and deskewed with the true motion, in the
/// frame of the LADAR's mount at the middle of its time. The mount has no error.
[[nodiscard]] ScanSet simulate_scans(const sim::Scenario& scenario, int models);

}  // namespace rcs::studies
