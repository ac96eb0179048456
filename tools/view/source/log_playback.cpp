#include "tools/view/source/log_playback.h"

#include <algorithm>
#include <utility>

#include "rcs/ros2/clock_estimate.h"
#include "tools/recording/message_fields.h"
#include "tools/studies/explanation.h"
#include "tools/view/source/placed_scans.h"

namespace rcs::view {
namespace {

/// About 50 pictures in a second of what is played.
constexpr std::chrono::milliseconds kTick{20};
/// More events than this in one tick are not played one by one: at a high speed the viewer goes
/// from moment to moment.
constexpr std::size_t kMaxEventsPerTick = 4000;
/// Of the scans that surround a moment.
constexpr Duration kRecent = std::chrono::seconds(6);

}  // namespace

Result<std::unique_ptr<LogPlayback>> LogPlayback::open(
    const std::string& path, boost::asio::io_context* io, RunTimeline* timeline,
    const std::function<bool(double)>& progress) {
  ros2::ClockEstimate clocks;
  Result<LogIndex> index = LogIndex::build(
      path,
      [&](const LogEvent& event, Duration time) {
        timeline->add(event.channel, event.data.data(), event.data.size(), time);
        if (clocks.complete()) return;
        const auto head = recording::read_head(event.channel, event.data);
        if (head) clocks.add(event.channel, head->utime, event.stamp);
      },
      progress);
  if (!index) return index.error();
  return std::unique_ptr<LogPlayback>(
      new LogPlayback(std::move(index).value(), clocks.offsets(), io));
}

LogPlayback::LogPlayback(LogIndex index, const ros2::ClockOffsets& clocks,
                         boost::asio::io_context* io)
    : index_(std::move(index)), clocks_(clocks), clock_(index_.duration()), timer_(*io) {}

void LogPlayback::play() {
  if (clock_.playing()) return;
  const bool jumped = clock_.play();
  if (jumped) seek(clock_.time());
  last_tick_ = {};
  sink_->on_state();
  run_timer();
}

void LogPlayback::pause() {
  clock_.pause();
  sink_->on_state();
}

void LogPlayback::seek(Duration time) {
  clock_.seek(time);
  next_ = index_.first_after(clock_.time());
  sink_->on_jump();
  sink_->on_state();
}

void LogPlayback::set_speed(double speed) {
  clock_.set_speed(speed);
  sink_->on_state();
}

void LogPlayback::run_timer() {
  if (timer_runs_) return;
  timer_runs_ = true;
  timer_.expires_after(kTick);
  timer_.async_wait([this](const boost::system::error_code& error) {
    timer_runs_ = false;
    if (error) return;
    tick();
    if (clock_.playing()) run_timer();
  });
}

void LogPlayback::tick() {
  const auto now = timer_.expiry();
  const bool first = last_tick_ == boost::asio::steady_timer::time_point{};
  const auto elapsed = first ? kTick : now - last_tick_;
  last_tick_ = now;
  clock_.advance(std::chrono::duration_cast<Duration>(elapsed));
  emit_until_now();
  if (!clock_.playing()) sink_->on_state();  // the end of the log
}

void LogPlayback::emit_until_now() {
  const std::size_t end = index_.first_after(clock_.time());
  if (end - std::min(end, next_) > kMaxEventsPerTick) {
    next_ = end;
    sink_->on_jump();
    return;
  }
  for (; next_ < end; ++next_) {
    if (!index_.read(next_, &event_)) {
      clock_.pause();
      sink_->on_failure(index_.path() + ": the file can no longer be read");
      return;
    }
    sink_->on_message(message(event_, index_.time(next_)));
  }
}

SourceMessage LogPlayback::message(const LogEvent& event, Duration time) const {
  return {event.channel, event.data.data(), event.data.size(), time, to_utime(event.stamp)};
}

void LogPlayback::state(ChannelSet channels,
                        const std::function<void(const SourceMessage&)>& visit) {
  for (const std::size_t event : index_.state_at(clock_.time(), channels)) {
    if (index_.read(event, &event_)) visit(message(event_, index_.time(event)));
  }
}

Result<nlohmann::ordered_json> LogPlayback::pair(const ScanPairRequest& request) {
  ScanPairRequest within = request;
  within.time = std::clamp(request.time, Duration{}, index_.duration());
  return scan_pair(&index_, within);
}

std::string LogPlayback::recent_scans(Duration time) {
  return placed_scans(&index_, clocks_, std::clamp(time, Duration{}, index_.duration()), kRecent);
}

nlohmann::ordered_json LogPlayback::explain(Duration time) {
  const Duration moment = std::clamp(time, Duration{}, index_.duration());
  static const ChannelSet kEvents = channels_of("*_EVENT");
  std::vector<std::size_t> events =
      index_.recent(moment, studies::MessageHistory::kEvents, kEvents);
  const std::vector<std::size_t> others =
      index_.recent(moment, studies::MessageHistory::kRecent, ~kEvents);
  events.insert(events.end(), others.begin(), others.end());
  std::sort(events.begin(), events.end());
  studies::MessageHistory history;
  for (const std::size_t event : events) {
    if (!index_.read(event, &event_)) continue;
    event_.stamp = index_.begin() + index_.time(event);
    history.add(event_);
  }
  studies::Explanation explained =
      studies::explanation_of(history, index_.path(), index_.begin(), index_.begin() + moment);
  explained.json["text"] = std::move(explained.text);
  return std::move(explained.json);
}

}  // namespace rcs::view
