#pragma once
// The unit of computing budgets inside algorithms, which never read a clock.

#include <cstdint>

namespace rcs {

/// One work unit is one point in one iteration (SP) or one expansion of the path search (BG).
using WorkUnits = std::int64_t;

}  // namespace rcs
