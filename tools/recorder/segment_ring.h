#pragma once
// A ring of files (segments) in one folder: records are appended to the newest segment, and the
// oldest segment is deleted when the sum of all exceeds its limit. The names of segments begin with
// a number that increases for ever, also over restarts: their order does not depend on the wall
// clock, and no segment is overwritten.

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "tools/recorder/batch.h"
#include "tools/recorder/folder.h"

namespace rcs::recorder {

struct RingParams {
  std::string prefix;              ///< of the names, e.g. "rcs-"
  std::string suffix;              ///< e.g. ".log"
  std::int64_t max_bytes = 0;      ///< of all segments
  std::int64_t segment_bytes = 0;  ///< a larger one only holds one record; <= max_bytes / 2
  Duration segment_duration = kMaxDuration;
};

/// Progress of storing a batch.
struct BatchPosition {
  std::size_t record = 0;  ///< the first that is not stored completely
  std::size_t byte = 0;    ///< the first that is not stored
};

class SegmentRing {
 public:
  /// More are not kept, so that a disk with errors cannot fill the folder with short segments.
  static constexpr std::size_t kMaxSegments = 20'000;

  SegmentRing(Folder* folder, RingParams params) : folder_(folder), params_(std::move(params)) {}

  /// Finds the segments of former runs: they count, and are deleted first. @return error
  [[nodiscard]] int open();

  /// Appends the rest of the batch, in as many segments as are needed, and moves `at`. After an
  /// error it can be called again with the same `at`.
  /// @return error, 0: the batch is stored (and on the disk after sync())
  [[nodiscard]] int append(const Batch& batch, BatchPosition* at);
  /// Returns when everything appended is on the disk. @return error
  [[nodiscard]] int sync();
  /// The next record begins a new segment. What was appended since sync() may be incomplete; an
  /// empty segment is deleted.
  void abandon_segment();

  /// The newest segment that holds records is never shed.
  [[nodiscard]] bool can_shed() const {
    return segments_.size() > (!segments_.empty() && segments_.back().bytes == 0 ? 2U : 1U);
  }
  /// Deletes the oldest segment. @param freed  its bytes @return error
  [[nodiscard]] int shed_oldest(std::int64_t* freed);

  [[nodiscard]] std::int64_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t segments() const { return segments_.size(); }
  /// Segments deleted because the ring had reached its limit.
  [[nodiscard]] std::int64_t shed_by_limit() const { return shed_by_limit_; }

 private:
  struct Segment {
    std::int64_t number = 0;
    std::string name;
    std::int64_t bytes = 0;
  };

  [[nodiscard]] std::int64_t number_of(const std::string& name) const;
  [[nodiscard]] std::string name_of(std::int64_t number, Stamp stamp) const;
  [[nodiscard]] bool segment_is_full(const Batch& batch, std::size_t record) const;
  [[nodiscard]] int begin_segment(Stamp stamp);
  [[nodiscard]] std::size_t fitting_end(const Batch& batch, std::size_t record) const;
  [[nodiscard]] int make_room(std::int64_t bytes);

  Folder* folder_;
  RingParams params_;
  std::deque<Segment> segments_;      // the oldest first
  std::unique_ptr<AppendFile> file_;  // of the newest; null: the next record begins one
  Stamp begun_;                       // the segment of file_
  std::int64_t bytes_ = 0;
  std::int64_t next_number_ = 1;
  std::int64_t shed_by_limit_ = 0;
  bool unsynced_ = false;       // bytes of file_
  bool unsynced_name_ = false;  // of file_
};

}  // namespace rcs::recorder
