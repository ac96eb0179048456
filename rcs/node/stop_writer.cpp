#include "rcs/node/stop_writer.h"

#include <cerrno>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/node/process/worker_thread.h"

namespace rcs {

std::optional<Outcome> StopWriterInCall::finished() { return std::exchange(result_, std::nullopt); }

StopWriterThread::StopWriterThread(Io io) : io_(std::move(io)) {
  RCS_CHECK(sem_init(&waiting_, 0, 0) == 0);
  thread_ = worker_thread([this] { work(); });
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
  waits_ = true;
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
    if (waits_.exchange(false)) {
      result_ = io_(job_);
      done_.store(true, std::memory_order_release);
    }
    if (stop_) return;
  }
}

}  // namespace rcs
