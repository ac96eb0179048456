#pragma once
// Drives with randomly drawn faults of INS, GPS and LADAR, two at once, and the laws that every
// step of the fault detection obeys.

namespace rcs::wm {

/// Expects of `drives` drives: what is excluded is not fused; the published status of each source
/// is that of the filter; and in the last 40 s, which begin 25 s after the last fault, each source
/// is used again.
/// @param first_seed  of the sensors and the faults
void expect_laws(unsigned first_seed, int drives);

}  // namespace rcs::wm
