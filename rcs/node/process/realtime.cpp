#include "rcs/node/process/realtime.h"

#include <dirent.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace rcs {
namespace {

/// More than the deepest call of a cycle needs; the rest of the stack is never touched.
constexpr std::size_t kStackBytes = std::size_t{512} << 10;
constexpr std::size_t kPageBytes = 4096;
constexpr int kBackground = SCHED_IDLE;

struct CloseDirectory {
  void operator()(DIR* d) const { (void)closedir(d); }
};

/// The threads of this process, except the calling thread and those in the background.
std::vector<pid_t> other_threads() {
  std::vector<pid_t> threads;
  const std::unique_ptr<DIR, CloseDirectory> tasks(opendir("/proc/self/task"));
  if (tasks == nullptr) return threads;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the stream is local
  while (const dirent* entry = readdir(tasks.get())) {
    const auto id = static_cast<pid_t>(std::strtol(entry->d_name, nullptr, 10));
    if (id <= 0 || id == gettid()) continue;  // "." and ".." are 0
    if (sched_getscheduler(id) != kBackground) threads.push_back(id);
  }
  return threads;
}

/// @return 0 or an errno
int schedule_fifo(pid_t thread, int priority) {
  sched_param param{};
  param.sched_priority = priority;
  // Reset on fork: child processes must not inherit the priority.
  return sched_setscheduler(thread, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) == 0 ? 0 : errno;
}

/// @return 0 or an errno
int run_on(pid_t thread, const std::vector<int>& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &set);
  return sched_setaffinity(thread, sizeof set, &set) == 0 ? 0 : errno;
}

/// Whether this process may lock more than `limit_bytes`, tested by locking an address range of
/// that size without memory behind it.
bool may_lock_more_than(std::size_t limit_bytes) {
  const std::size_t size = (limit_bytes / kPageBytes + 1) * kPageBytes;
  void* const range =
      mmap(nullptr, size, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (range == MAP_FAILED) return false;
  const bool granted = mlock2(range, size, MLOCK_ONFAULT) == 0;
  (void)munmap(range, size);
  return granted;
}

/// @return "" or the reason of the failure
std::string lock_memory() {
  rlimit limit{};
  (void)getrlimit(RLIMIT_MEMLOCK, &limit);
  limit.rlim_cur = limit.rlim_max;
  (void)setrlimit(RLIMIT_MEMLOCK, &limit);
  // Within a finite limit, mlockall would succeed now and a later allocation would fail.
  if (limit.rlim_max != RLIM_INFINITY && !may_lock_more_than(limit.rlim_max)) {
    return fmt::format("RLIMIT_MEMLOCK is {} kB; it must be unlimited", limit.rlim_max / 1024);
  }
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? "" : std::strerror(errno);
}

/// Touches the stack as deep as a cycle may go, so that its pages are present (and locked).
[[gnu::noinline]] void prefault_stack() {
  std::array<volatile unsigned char, kStackBytes> stack;
  for (std::size_t i = 0; i < kStackBytes; i += kPageBytes) stack[i] = 0;
}

}  // namespace

RealtimeGrant request_realtime(const RealtimeParams& params) {
  RealtimeGrant grant;
  if (sched_getscheduler(0) == kBackground) {
    grant.refusals.emplace_back(
        "started under SCHED_IDLE (background): no real-time request is granted");
    return grant;
  }
  const std::vector<pid_t> others = other_threads();
  if (!params.cpus.empty()) {
    int failed = run_on(0, params.cpus);
    for (const pid_t thread : others) {
      if (failed == 0) failed = run_on(thread, params.cpus);
    }
    if (failed != 0) {
      std::string cpus;
      for (const int cpu : params.cpus) cpus += fmt::format("{}{}", cpus.empty() ? "" : ",", cpu);
      grant.refusals.push_back(
          fmt::format("processors {} not granted: {}", cpus,
                      failed == EINVAL ? "no such processors" : std::strerror(failed)));
    }
  }
  if (params.lock_memory) {
    const std::string why_not = lock_memory();
    grant.memory_locked = why_not.empty();
    if (!grant.memory_locked) grant.refusals.push_back("memory not locked: " + why_not);
    prefault_stack();
  }
  if (params.realtime_priority > 0) {
    // The receiver first: it must not keep a lower priority than the node.
    int failed = 0;
    for (const pid_t thread : others) {
      if (failed == 0) failed = schedule_fifo(thread, params.realtime_priority + 1);
    }
    if (failed == 0) failed = schedule_fifo(0, params.realtime_priority);
    if (failed == 0) {
      grant.realtime_priority = params.realtime_priority;
    } else {
      grant.refusals.push_back(fmt::format("SCHED_FIFO {} not granted: {}",
                                           params.realtime_priority, std::strerror(failed)));
    }
  }
  return grant;
}

bool run_in_background() {
  const sched_param param{};
  return sched_setscheduler(0, kBackground, &param) == 0;
}

}  // namespace rcs
