#pragma once
// A log as a source: its messages at their times, at any speed, from any moment.

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>

#include "rcs/base/result.h"
#include "tools/view/run_timeline.h"
#include "tools/view/source/log_index.h"
#include "tools/view/source/play_clock.h"
#include "tools/view/source/source.h"

namespace rcs::view {

class LogPlayback final : public Source {
 public:
  /// Indexes the log, and collects its timeline.
  /// @param progress  called with the share of the log that was read; returns false to stop
  static Result<std::unique_ptr<LogPlayback>> open(const std::string& path,
                                                   boost::asio::io_context* io,
                                                   RunTimeline* timeline,
                                                   const std::function<bool(double)>& progress);

  [[nodiscard]] bool live() const override { return false; }
  [[nodiscard]] std::string name() const override { return index_.path(); }
  [[nodiscard]] ChannelSet channels() const override { return index_.channels(); }
  [[nodiscard]] ros2::ClockOffsets clocks() const override { return clocks_; }
  [[nodiscard]] Duration time() const override { return clock_.time(); }
  [[nodiscard]] std::int64_t begin_utime() const override { return to_utime(index_.begin()); }
  [[nodiscard]] Duration duration() const override { return clock_.duration(); }
  [[nodiscard]] bool playing() const override { return clock_.playing(); }
  [[nodiscard]] double speed() const override { return clock_.speed(); }
  [[nodiscard]] const LogIndex& index() const { return index_; }

  void play() override;
  void pause() override;
  void seek(Duration time) override;
  void set_speed(double speed) override;
  void state(ChannelSet channels, const std::function<void(const SourceMessage&)>& visit) override;
  [[nodiscard]] nlohmann::ordered_json explain(Duration time) override;
  [[nodiscard]] std::string recent_scans(Duration time) override;
  [[nodiscard]] Result<nlohmann::ordered_json> pair(const ScanPairRequest& request) override;
  void start(SourceSink* sink) override { sink_ = sink; }

 private:
  LogPlayback(LogIndex index, const ros2::ClockOffsets& clocks, boost::asio::io_context* io);
  void tick();
  void run_timer();
  void emit_until_now();
  [[nodiscard]] SourceMessage message(const LogEvent& event, Duration time) const;

  LogIndex index_;
  ros2::ClockOffsets clocks_;
  PlayClock clock_;
  std::size_t next_ = 0;  // event
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer::time_point last_tick_;
  bool timer_runs_ = false;
  SourceSink* sink_ = nullptr;
  LogEvent event_;  // reused
};

}  // namespace rcs::view
