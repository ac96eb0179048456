#pragma once
// A log as the outside of a replay, and the recorder of what comes of it.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs {

/// Feeds the events of chosen channels at their log timestamps; the others are passed over, so that
/// a recorded run can be replayed: its old outputs must not meet the new ones.
///
/// Where the log's own clock jumped (it steps back more than kMaxBack or ahead more than
/// kMaxAhead), the time line goes on without the jump: a wild stamp cannot make a replay run for
/// years.
class LogSource final : public EventSource {
 public:
  static constexpr Duration kMaxBack = std::chrono::seconds(1);
  static constexpr Duration kMaxAhead = std::chrono::minutes(10);

  /// @param reader  outlives the source; its health() tells afterwards what could not be read
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

/// Writes what a LocalBus delivers, but for the channels named, into a log, stamped with its due.
/// A failure (a full disk) stays in the writer: LogWriter::close() tells it.
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
