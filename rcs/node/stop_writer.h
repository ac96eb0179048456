#pragma once
// Executes the jobs of a stop latch on the disk: within the call, or in a thread (ADR 84).

#include <semaphore.h>

#include <atomic>
#include <functional>
#include <optional>
#include <thread>

#include "rcs/node/stop_file.h"

namespace rcs {

/// One job at a time. For one caller.
class StopWriter {
 public:
  /// execute(), except in tests
  using Io = std::function<Outcome(const StopJob&)>;

  StopWriter() = default;
  StopWriter(const StopWriter&) = delete;
  StopWriter& operator=(const StopWriter&) = delete;
  virtual ~StopWriter() = default;

  /// Begins a job. The result of the one before must have been collected.
  virtual void start(StopJob job) = 0;
  /// Result of the job that was begun, once; nullopt: it has not ended.
  [[nodiscard]] virtual std::optional<Outcome> finished() = 0;
};

/// start() waits for the disk.
class StopWriterInCall final : public StopWriter {
 public:
  explicit StopWriterInCall(Io io = execute) : io_(std::move(io)) {}
  void start(StopJob job) override { result_ = io_(job); }
  [[nodiscard]] std::optional<Outcome> finished() override;

 private:
  Io io_;
  std::optional<Outcome> result_;
};

/// start() and finished() never wait for the disk, however long a job lasts.
class StopWriterThread final : public StopWriter {
 public:
  explicit StopWriterThread(Io io = execute);
  ~StopWriterThread() override;  ///< a job that was begun is executed first
  void start(StopJob job) override;
  [[nodiscard]] std::optional<Outcome> finished() override;

 private:
  void work();

  Io io_;
  bool begun_ = false;  // the caller's
  StopJob job_;         // the thread's from start() until done_
  Outcome result_ = Done{};
  std::atomic<bool> waits_{false};  // a job that the thread has not begun
  std::atomic<bool> done_{false};
  std::atomic<bool> stop_{false};
  sem_t waiting_{};  // a job has been begun, or the thread is to end
  std::thread thread_;
};

}  // namespace rcs
