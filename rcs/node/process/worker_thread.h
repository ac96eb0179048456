#pragma once
// Threads beside the thread of the cycles.

#include <pthread.h>

#include <csignal>
#include <thread>
#include <utility>

namespace rcs {

/// A thread that handles no signal. A thread inherits the signal mask: otherwise a signal that the
/// thread of the cycles blocks later, to end in order, could end the process in this one.
template <class Work>
[[nodiscard]] std::thread worker_thread(Work&& work) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::forward<Work>(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace rcs
