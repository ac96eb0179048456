#pragma once
// A log as the event source of a replay, and the recorder of the replay's messages.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs {

/// Publishes the events of selected channels at their log timestamps and skips the others: the old
/// outputs of a recorded run must not mix with the new ones.
///
/// Where the log's own clock jumped (back by more than kMaxBack or ahead by more than kMaxAhead),
/// the timeline continues without the jump: an invalid stamp cannot make a replay run for years.
class LogSource final : public EventSource {
 public:
  static constexpr Duration kMaxBack = std::chrono::seconds(1);
  static constexpr Duration kMaxAhead = std::chrono::minutes(10);

  /// @param reader  outlives the source; its health() reports afterwards what could not be read
  LogSource(LogReader* reader, std::vector<std::string> channels);

  [[nodiscard]] Stamp peek() override { return due_; }
  void take(SourceEvent* event) override;

  [[nodiscard]] std::int64_t fed() const { return fed_; }
  [[nodiscard]] std::int64_t passed_over() const { return passed_over_; }
  [[nodiscard]] std::int64_t clock_jumps() const { return clock_jumps_; }

 private:
  void read_ahead();

  LogReader* reader_;
  std::vector<std::string> channels_;
  LogEvent next_;
  Stamp due_ = Stamp::max();
  Stamp last_due_ = Stamp::min();
  Duration offset_{};  ///< log stamp + offset = due
  std::int64_t fed_ = 0;
  std::int64_t passed_over_ = 0;
  std::int64_t clock_jumps_ = 0;
};

/// Writes the messages that a LocalBus delivers, except those of the named channels, into a log,
/// stamped with their due time. LogWriter::close() returns a failure (a full disk).
class LogRecorder final : public BusTap {
 public:
  LogRecorder(LogWriter* writer, std::vector<std::string> channels_not_recorded)
      : writer_(writer), not_recorded_(std::move(channels_not_recorded)) {}

  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override;

 private:
  LogWriter* writer_;
  std::vector<std::string> not_recorded_;
};

}  // namespace rcs
