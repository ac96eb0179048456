#pragma once
// A log, or all segments of a recording (`rcs record`) in their order, as one log.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/log/log_file.h"

namespace rcs::recording {

class LogSeries {
 public:
  /// @param path  a log, or the folder of a recording; errors name it
  static Result<LogSeries> open(const std::string& path);

  /// The next event, in reused buffers; false at the end: then check health().
  [[nodiscard]] bool next(LogEvent* event);

  /// Of all segments read so far.
  [[nodiscard]] LogHealth health() const;
  [[nodiscard]] std::int64_t size_bytes() const { return size_; }
  [[nodiscard]] std::int64_t position_bytes() const;  ///< for progress

 private:
  struct Segment {
    std::string path;
    std::int64_t bytes = 0;
  };
  bool open_next();

  std::vector<Segment> segments_;
  std::size_t next_segment_ = 0;
  std::optional<LogReader> reader_;
  std::int64_t size_ = 0;
  std::int64_t finished_bytes_ = 0;  // of the segments before reader_
  LogHealth finished_;
};

}  // namespace rcs::recording
