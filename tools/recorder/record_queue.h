#pragma once
// Hands messages and audit lines from the receiver to the thread that stores them. The receiver
// never waits for the disk: what does not fit is dropped and counted.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string_view>

#include "tools/recorder/batch.h"

namespace rcs::recorder {

class RecordQueue {
 public:
  struct Counts {
    std::int64_t received = 0;
    std::int64_t dropped = 0;   ///< the queue was full: the disk is too slow
    std::int64_t rejected = 0;  ///< a log cannot hold the message: its channel or its size
    std::int64_t audit_lines_dropped = 0;
  };
  static constexpr std::size_t kMaxAuditBytes = std::size_t{4} << 20;

  /// @param max_bytes  of messages that wait
  explicit RecordQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// A message as an event of a log. Its number counts the received messages, so that a dropped one
  /// is missing in the numbers.
  /// @param stamp  wall clock
  void push_message(Stamp stamp, std::string_view channel, const std::uint8_t* data,
                    std::size_t size) noexcept;
  /// A line without its end. It ends wait().
  void push_audit_line(Stamp stamp, std::string_view line) noexcept;

  void count_lost_audit_line() noexcept;

  /// Waits until `time` has passed, an audit line waits, the queue is half full or closed.
  void wait(Duration time);
  /// Takes everything that waits; the batches are cleared first and their buffers reused.
  /// @return false: closed, this was the rest
  bool take(Batch* messages, Batch* audit);
  void close();

  [[nodiscard]] Counts counts() const;

 private:
  std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  Batch messages_;
  Batch audit_;
  Counts counts_;
  bool closed_ = false;
};

}  // namespace rcs::recorder
