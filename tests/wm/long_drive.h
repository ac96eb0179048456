#pragma once
// A long drive with everything on, for what must hold at every moment of it.

#include <cstddef>

#include "modules/wm/filter.h"

namespace rcs::wm {

double smallest_eigenvalue(const Cov& P);

/// Fails the test where P is not symmetric, finite and positive, or the drive ends 2 m off.
/// @param check_every  INS samples (10 ms)
void expect_covariance_stays_sound(double length_s, std::size_t check_every);

}  // namespace rcs::wm
