#pragma once
// Where each event of a log is, so that a viewer can go to any moment.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/log/log_file.h"
#include "tools/view/server/topic_table.h"

namespace rcs::view {

/// The time of a log runs from 0 at its first event. It does not step back, and where the log's own
/// clock jumps ahead by more than kMaxAhead it continues without the jump.
class LogIndex {
 public:
  static constexpr Duration kMaxAhead = std::chrono::minutes(10);

  /// Reads the log once.
  /// @param visit  called with every event of a channel of this system, and its time
  /// @param progress  called with the share of the log that was read; returns false to stop
  static Result<LogIndex> build(
      const std::string& path, const std::function<void(const LogEvent&, Duration)>& visit,
      const std::function<bool(double)>& progress = [](double) { return true; });

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::size_t size() const { return events_.size(); }
  [[nodiscard]] Duration duration() const {
    return events_.empty() ? Duration{} : events_.back().time;
  }
  [[nodiscard]] Stamp begin() const { return begin_; }  ///< stamp of the first event
  [[nodiscard]] Duration time(std::size_t event) const { return events_[event].time; }
  [[nodiscard]] ChannelSet channels() const { return channels_; }      ///< that have events
  [[nodiscard]] std::int64_t foreign() const { return foreign_; }      ///< events of other channels
  [[nodiscard]] const std::string& damage() const { return damage_; }  ///< empty: none

  /// The first event later than `time`; size(): there is none.
  [[nodiscard]] std::size_t first_after(Duration time) const;
  /// The events at or before `time` that describe the state at that moment, in their order: of each
  /// channel the newest, and of scans, poses, accounts and events those of some seconds.
  [[nodiscard]] std::vector<std::size_t> state_at(Duration time, ChannelSet channels) const;
  /// Of the channels: the events within (time - span, time], and the newest of each.
  [[nodiscard]] std::vector<std::size_t> recent(Duration time, Duration span,
                                                ChannelSet channels) const;
  /// @return false: the file can no longer be read there
  [[nodiscard]] bool read(std::size_t event, LogEvent* out);

 private:
  struct Entry {
    std::int64_t position = 0;  // in the file
    Duration time{};
    std::uint8_t channel = 0;
  };
  explicit LogIndex(LogReader reader) : reader_(std::move(reader)) {}
  void add_recent(std::size_t channel, Duration time, Duration span,
                  std::vector<std::size_t>* out) const;

  LogReader reader_;
  std::string path_;
  Stamp begin_;
  std::vector<Entry> events_;
  std::vector<std::vector<std::uint32_t>> by_channel_;
  ChannelSet channels_ = 0;
  std::int64_t foreign_ = 0;
  std::string damage_;
};

}  // namespace rcs::view
