#pragma once
// Messages to systemd (sd_notify(3)), which restarts a service that falls silent.

#include <string_view>

namespace rcs::cli {

/// Sends "READY=1", "WATCHDOG=1" or "STOPPING=1" to the socket in $NOTIFY_SOCKET; without one
/// nothing. Never blocks.
void notify_service_manager(std::string_view state);

}  // namespace rcs::cli
