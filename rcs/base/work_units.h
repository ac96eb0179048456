#pragma once
// The currency of time budgets inside algorithms, which never look at a clock.

#include <cstdint>

namespace rcs {

/// One work unit is one point in one iteration.
using WorkUnits = std::int64_t;

}  // namespace rcs
