#pragma once
// Runs a recorder on a thread of its own, often enough that less than a second is lost when the
// process is killed or the power fails.

#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>

#include "tools/recorder/record_queue.h"
#include "tools/recorder/recorder.h"

namespace rcs::recorder {

/// The cycle of the thread, without the thread.
class RecorderCycle {
 public:
  /// From the beginning of one storing to the next. What was received just after the beginning of
  /// one is on the disk at the end of the next one: with a disk that stores within half a second, a
  /// second later at most.
  static constexpr Duration kPeriod = from_milliseconds(250.0);
  using Clock = std::function<Stamp()>;

  RecorderCycle(RecordQueue* queue, Recorder* recorder, Clock clock)
      : queue_(queue), recorder_(recorder), clock_(std::move(clock)), began_(clock_()) {}

  /// Time until the next run(); it may be called earlier.
  [[nodiscard]] Duration pause() const;
  /// Stores what waits in the queue. @return false: the queue is closed, this was the rest
  bool run();
  /// Of the last run(): the age of the oldest message that could have been lost before its end.
  [[nodiscard]] Duration exposure() const { return exposure_; }

 private:
  RecordQueue* queue_;
  Recorder* recorder_;
  Clock clock_;
  Batch messages_;
  Batch audit_;
  Stamp began_;
  Duration exposure_{};
};

class RecorderThread {
 public:
  struct State {
    RecorderStatus recorder;
    RecordQueue::Counts queue;
    Duration max_exposure{};  ///< largest RecorderCycle::exposure() since the last state()
    std::int64_t cycles = 0;  ///< of the thread: unchanged while the disk does not respond
  };

  /// @param max_waiting_bytes  of messages that wait for the disk
  /// @param clock  monotonic
  RecorderThread(Recorder* recorder, std::size_t max_waiting_bytes, RecorderCycle::Clock clock);
  RecorderThread(const RecorderThread&) = delete;
  RecorderThread& operator=(const RecorderThread&) = delete;
  ~RecorderThread() { stop(); }

  [[nodiscard]] RecordQueue& queue() { return queue_; }
  [[nodiscard]] State state();
  /// Stores everything that waits and ends the thread.
  void stop();

 private:
  void run();

  RecordQueue queue_;
  Recorder* recorder_;
  RecorderCycle cycle_;
  std::mutex mutex_;
  State state_;
  std::thread thread_;  // last: it uses the others
};

}  // namespace rcs::recorder
