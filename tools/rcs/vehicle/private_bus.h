#pragma once
// A bus of one's own: the program starts anew inside a network namespace in which multicast goes to
// lo, so that what it sends reaches no vehicle and nothing of others reaches it.

#include <string>

#include "rcs/base/result.h"

namespace rcs::cli {

/// Does not return when it succeeds: this program runs again, with the same arguments, and finds
/// itself inside. Call it before any thread or child.
/// @return Done when it is inside already; else why the system does not allow it
[[nodiscard]] Outcome enter_private_bus();

}  // namespace rcs::cli
