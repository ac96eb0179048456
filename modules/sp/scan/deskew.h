#pragma once
// Deskew: motion compensation of a scan's points.

#include "modules/sp/scan/scan.h"
#include "modules/sp/scan/scan_motion.h"

namespace rcs::sp {

/// Moves every point to the reference instant: p <- T_reference_vehicle(dt) * p, linear between
/// the table's knots. All dt must lie inside the table.
void deskew(const MotionTable& motion, Scan* scan);

}  // namespace rcs::sp
