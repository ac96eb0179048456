#include "rcs/node/stop_writer.h"

#include <pthread.h>

#include <cerrno>
#include <csignal>
#include <utility>

#include "rcs/base/check.h"

namespace rcs {

std::optional<Outcome> StopWriterInCall::finished() { return std::exchange(result_, std::nullopt); }

StopWriterThread::StopWriterThread(Io io) : io_(std::move(io)) {
  RCS_CHECK(sem_init(&waiting_, 0, 0) == 0);
  // A thread inherits the signal mask: only the thread of the cycles handles signals.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

StopWriterThread::~StopWriterThread() {
  stop_ = true;
  sem_post(&waiting_);
  thread_.join();
  sem_destroy(&waiting_);
}

void StopWriterThread::start(StopJob job) {
  RCS_CHECK(!begun_);
  begun_ = true;
  job_ = std::move(job);
  sem_post(&waiting_);  // makes the job visible to the thread: posting is a release
}

std::optional<Outcome> StopWriterThread::finished() {
  if (!begun_ || !done_.load(std::memory_order_acquire)) return std::nullopt;
  done_.store(false, std::memory_order_relaxed);
  begun_ = false;
  return std::exchange(result_, Done{});
}

void StopWriterThread::work() {
  for (;;) {
    while (sem_wait(&waiting_) != 0) RCS_CHECK(errno == EINTR);
    if (stop_) return;
    result_ = io_(job_);
    done_.store(true, std::memory_order_release);
  }
}

}  // namespace rcs
