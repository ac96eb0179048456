#include "tools/recording/log_series.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "tools/base/files.h"

namespace rcs::recording {
namespace {

namespace fs = std::filesystem;

/// "rcs-00000017-20261126T183404Z.log"; other logs in the folder, e.g. a part that was cut, are not
/// read.
bool is_segment(const fs::path& path) {
  return path.extension() == ".log" && path.filename().string().rfind("rcs-", 0) == 0;
}

void add(const LogHealth& health, LogHealth* sum) {
  sum->events += health.events;
  sum->skipped_bytes += health.skipped_bytes;
  sum->skips += health.skips;
  sum->truncated = sum->truncated || health.truncated;
  if (sum->io_error.empty()) sum->io_error = health.io_error;
}

}  // namespace

Result<LogSeries> LogSeries::open(const std::string& path) {
  LogSeries series;
  std::error_code error;
  if (fs::is_directory(path, error)) {
    for (auto entry = fs::directory_iterator(path, error);
         !error && entry != fs::directory_iterator(); entry.increment(error)) {
      std::error_code vanished;
      if (!is_segment(entry->path()) || !entry->is_regular_file(vanished)) continue;
      const std::uintmax_t bytes = entry->file_size(vanished);
      if (vanished) continue;
      series.segments_.push_back({entry->path().string(), static_cast<std::int64_t>(bytes)});
    }
    if (error) return Error{path + ": cannot read the folder: " + error.message()};
    if (series.segments_.empty()) {
      return Error{path + ": no segment of a recording (rcs-*.log) in this folder"};
    }
    std::sort(series.segments_.begin(), series.segments_.end(),
              [](const Segment& a, const Segment& b) { return a.path < b.path; });
  } else {
    Result<LogReader> reader = LogReader::open(path);
    if (!reader) return reader.error();
    series.segments_.push_back({path, reader->size_bytes()});
  }
  for (const Segment& segment : series.segments_) {
    tools::note_input(segment.path);
    series.size_ += segment.bytes;
  }
  if (!series.open_next() && !series.finished_.io_error.empty()) {
    return Error{series.finished_.io_error};
  }
  return series;
}

/// @return false: none is left, or an error is in finished_
bool LogSeries::open_next() {
  if (reader_) {
    add(reader_->health(), &finished_);
    finished_bytes_ += reader_->size_bytes();
    reader_.reset();
  }
  while (next_segment_ < segments_.size() && finished_.io_error.empty()) {
    const std::string& path = segments_[next_segment_++].path;
    Result<LogReader> opened = LogReader::open(path);
    if (opened) {
      reader_.emplace(std::move(opened).value());
      return true;
    }
    // A recorder that is running has deleted its oldest segment.
    std::error_code error;
    if (fs::exists(path, error)) finished_.io_error = opened.error().message;
  }
  return false;
}

bool LogSeries::next(LogEvent* event) {
  while (reader_) {
    if (reader_->next(event)) return true;
    if (!open_next()) return false;
  }
  return false;
}

LogHealth LogSeries::health() const {
  LogHealth sum = finished_;
  if (reader_) add(reader_->health(), &sum);
  return sum;
}

std::int64_t LogSeries::position_bytes() const {
  return finished_bytes_ + (reader_ ? reader_->position_bytes() : 0);
}

}  // namespace rcs::recording
