#pragma once
// Stores batches of messages and audit lines in a folder, and decides what is deleted when the disk
// is full. No clock, no threads, no text: recorder_thread.h runs it, recorder_report.h reports it.

#include <cstdint>

#include "tools/recorder/batch.h"
#include "tools/recorder/folder.h"
#include "tools/recorder/segment_ring.h"

namespace rcs::recorder {

struct RecorderParams {
  RingParams messages{"rcs-", ".log", std::int64_t{4096} << 20, std::int64_t{64} << 20,
                      std::chrono::seconds(60)};
  /// Audit lines have their own limit: messages never displace them.
  RingParams audit{"audit-", ".jsonl", std::int64_t{64} << 20, std::int64_t{8} << 20, kMaxDuration};
  /// Free space that is left to others, e.g. to the latch of an emergency stop.
  std::int64_t reserve_bytes = std::int64_t{256} << 20;
  /// Free space above the reserve before a recording that was stopped continues.
  std::int64_t resume_bytes = std::int64_t{16} << 20;
  /// Audit lines that wait for a full disk; further ones are lost, and counted.
  std::size_t max_waiting_audit_bytes = std::size_t{4} << 20;
};

struct RecorderStatus {
  std::int64_t messages = 0;  ///< stored, by this recorder
  std::int64_t bytes = 0;
  std::int64_t messages_lost = 0;  ///< received while the recording was stopped
  std::int64_t audit_lines = 0;    ///< stored
  std::int64_t audit_lines_lost = 0;
  std::int64_t audit_lines_waiting = 0;
  std::int64_t segments = 0;  ///< that exist, also of former runs
  std::int64_t segment_bytes = 0;
  std::int64_t shed_by_limit = 0;   ///< segments deleted because the ring had reached its size
  std::int64_t shed_for_space = 0;  ///< because the disk was full or below the reserve
  std::int64_t shed_for_space_bytes = 0;
  /// Why the recording is stopped (errno): ENOSPC if the disk is full, or below the reserve, and
  /// nothing is left to delete. 0: it runs.
  int stopped_by = 0;
  std::int64_t free_bytes = 0;
};

[[nodiscard]] bool is_disk_full(int error);

class Recorder {
 public:
  /// The folder outlives the recorder.
  Recorder(Folder* folder, const RecorderParams& params);

  /// Finds what former runs recorded. @return error
  [[nodiscard]] int open();

  /// Stores both batches and returns when they are on the disk. What cannot be stored is counted in
  /// the status, and the recording continues when it is possible again. An empty batch of messages
  /// also checks the free space.
  void store(const Batch& messages, const Batch& audit);

  [[nodiscard]] const RecorderStatus& status() const { return status_; }

 private:
  void keep_reserve();
  void store_audit(const Batch& audit);
  void store_messages(const Batch& messages);
  [[nodiscard]] bool shed_for_space();
  void stop(int error);
  void update_status();

  Folder* folder_;
  RecorderParams params_;
  SegmentRing messages_;
  SegmentRing audit_;
  Batch waiting_audit_;
  BatchPosition waiting_at_;
  int until_space_check_ = 0;  // calls of store()
  int until_retry_ = 0;
  RecorderStatus status_;
};

}  // namespace rcs::recorder
