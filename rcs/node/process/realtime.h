#pragma once
// What a process asks of the kernel so that its cycles start in time. Each is asked for on its own,
// and a refusal is told, never fatal: a node that runs late is better than none.

#include <string>
#include <vector>

namespace rcs {

struct RealtimeParams {
  int realtime_priority = 0;  ///< SCHED_FIFO; 0: ordinary scheduling
  bool lock_memory = false;   ///< no page of the process is ever fetched again from a disk
  std::vector<int> cpus;      ///< processors to run on; empty: any
};

struct RealtimeGrant {
  int realtime_priority = 0;
  bool memory_locked = false;
  std::vector<std::string> refusals;  ///< what was asked for and not granted, and why
};

/// For the calling thread and all threads that the process has by now, but for those in the
/// background; those are LCM's receiver, so call it when the bus and the node are there, just
/// before the first cycle.
///
/// The receiver gets one priority more than the node. At ordinary priority any program could keep
/// messages from a node that itself would run at once; at the node's own, on the same processor, a
/// long cycle would leave the socket's buffer to overflow. It takes microseconds a packet.
[[nodiscard]] RealtimeGrant request_realtime(const RealtimeParams& params);

/// For the calling thread, from now on: whatever else wants to run goes first, at once, and
/// request_realtime() passes it over.
/// @return false where the system does not let it (a container's filter): it stays as it was
[[nodiscard]] bool run_in_background();

}  // namespace rcs
