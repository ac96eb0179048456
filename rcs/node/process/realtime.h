#pragma once
// Requests of a process to the kernel so that its cycles start in time. Each request is made on its
// own; a refusal is reported and never fatal, because a late node is better than no node.

#include <string>
#include <vector>

namespace rcs {

struct RealtimeParams {
  int realtime_priority = 0;  ///< SCHED_FIFO; 0: ordinary scheduling
  bool lock_memory = false;   ///< prevents page faults to disk (mlockall)
  std::vector<int> cpus;      ///< processors to run on; empty: any
};

struct RealtimeGrant {
  int realtime_priority = 0;
  bool memory_locked = false;
  std::vector<std::string> refusals;  ///< requests not granted, with the reason
};

/// Applies to the calling thread and to the other present threads of the process except background
/// threads; the other threads are LCM's receiver. Call it when the bus and the node exist, just
/// before the first cycle.
///
/// The receiver gets one priority more than the node. At ordinary priority any program could delay
/// messages to a real-time node; at the node's own priority on the same processor, the socket's
/// buffer would overflow during a long cycle. The receiver needs microseconds for each packet.
[[nodiscard]] RealtimeGrant request_realtime(const RealtimeParams& params);

/// Gives the calling thread background priority: every other thread runs first, and
/// request_realtime() skips it.
/// @return false if the system does not permit it (a container's filter): the priority is unchanged
[[nodiscard]] bool run_in_background();

}  // namespace rcs
