#pragma once
// A private bus: the program restarts in a network namespace in which multicast is routed to lo, so
// that its messages reach no vehicle and it receives no messages of others.

#include <string>

#include "rcs/base/result.h"

namespace rcs::cli {

/// Does not return on success: the program is executed again inside the namespace, with the same
/// arguments. Call it before any thread or child is created.
/// @return Done if already inside; else an error with the reason
[[nodiscard]] Outcome enter_private_bus();

}  // namespace rcs::cli
