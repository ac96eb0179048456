#include "tools/recorder/recorder_thread.h"

#include <algorithm>
#include <utility>

namespace rcs::recorder {

Duration RecorderCycle::pause() const {
  return std::max(Duration::zero(), began_ + kPeriod - clock_());
}

bool RecorderCycle::run() {
  const Stamp previous = std::exchange(began_, clock_());
  const bool more = queue_->take(&messages_, &audit_);
  recorder_->store(messages_, audit_);
  exposure_ = clock_() - previous;
  return more;
}

RecorderThread::RecorderThread(Recorder* recorder, std::size_t max_waiting_bytes,
                               RecorderCycle::Clock clock)
    : queue_(max_waiting_bytes),
      recorder_(recorder),
      cycle_(&queue_, recorder, std::move(clock)),
      state_{recorder->status(), {}, {}, 0},
      thread_([this] { run(); }) {}

void RecorderThread::run() {
  for (bool more = true; more;) {
    queue_.wait(cycle_.pause());
    more = cycle_.run();
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.recorder = recorder_->status();
    ++state_.cycles;
    state_.max_exposure = std::max(state_.max_exposure, cycle_.exposure());
  }
}

RecorderThread::State RecorderThread::state() {
  const std::lock_guard<std::mutex> lock(mutex_);
  State state = state_;
  state.queue = queue_.counts();
  state_.max_exposure = Duration::zero();
  return state;
}

void RecorderThread::stop() {
  queue_.close();
  if (thread_.joinable()) thread_.join();
}

}  // namespace rcs::recorder
