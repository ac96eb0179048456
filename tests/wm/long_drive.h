#pragma once
// A long drive with all sensors, to check invariants at every moment.

#include <cstddef>

#include "modules/wm/filter.h"

namespace rcs::wm {

double smallest_eigenvalue(const Cov& P);

/// Fails the test where P is not symmetric, finite and positive, or the final error is 2 m or more.
/// @param check_every  INS samples (10 ms)
void expect_covariance_stays_sound(double length_s, std::size_t check_every);

}  // namespace rcs::wm
