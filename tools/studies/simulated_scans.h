#pragma once
// Scans of the simulated range imager, whose motion is known exactly.

#include "modules/sp/scan/range_image.h"
#include "sim/scenario.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::studies {

/// The range imager of the scenario; its points are in the frame of its mount.
[[nodiscard]] sp::LadarParams ladar_in_mount(const sim::Scenario& scenario);
/// A mount error would be common to all scans and not affect the motion between them.
[[nodiscard]] sim::MountParams without_error(sim::MountParams mount);

/// Scans k, k + 1 and k + 20 of a scripted drive, `models` times, evenly over the drive. Each is
/// computed from ranges as in sp (without mixed pixels) and deskewed with the true motion, in the
/// frame of the LADAR mount at the middle of its time. The mount has no error.
[[nodiscard]] ScanSet simulate_scans(const sim::Scenario& scenario, int models);

}  // namespace rcs::studies
