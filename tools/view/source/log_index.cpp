#include "tools/view/source/log_index.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

namespace rcs::view {
namespace {

/// What describes a moment before it: scans come in parts, of which the newest complete ones began
/// up to two scans ago; computing times and loads are statistics of some seconds.
struct StateSpan {
  const char* channels;
  Duration span;
};
constexpr StateSpan kStateSpans[] = {
    {"LADAR_RANGES, LADAR_POINTS, SP_POINTS, WM_NAV_STATE", std::chrono::seconds(1)},
    {"*_CYCLE, *_PROCESS", std::chrono::seconds(5)},
    {"*_EVENT", std::chrono::seconds(30)}};

Duration state_span(std::size_t channel) {
  static const std::vector<std::pair<ChannelSet, Duration>> kSpans = [] {
    std::vector<std::pair<ChannelSet, Duration>> spans;
    for (const StateSpan& s : kStateSpans) spans.emplace_back(channels_of(s.channels), s.span);
    return spans;
  }();
  for (const auto& [set, span] : kSpans) {
    if ((set & channel_bit(channel)) != 0) return span;
  }
  return {};
}

/// The time of a log without the jumps of its clock.
class SteadyTime {
 public:
  Duration at(Stamp stamp) {
    const Duration step = last_stamp_ ? stamp - *last_stamp_ : Duration{};
    if (step > Duration{} && step <= LogIndex::kMaxAhead) time_ += step;
    // A message that is a little late changes nothing; else the clock was set back.
    if (!last_stamp_ || step > Duration{} || -step > kMaxBack) last_stamp_ = stamp;
    return time_;
  }

 private:
  static constexpr Duration kMaxBack = std::chrono::seconds(1);
  std::optional<Stamp> last_stamp_;
  Duration time_{};
};

}  // namespace

Result<LogIndex> LogIndex::build(const std::string& path,
                                 const std::function<void(const LogEvent&, Duration)>& visit,
                                 const std::function<bool(double)>& progress) {
  Result<LogReader> reader = LogReader::open(path);
  if (!reader) return reader.error();
  LogIndex index(std::move(reader).value());
  index.path_ = path;
  index.by_channel_.resize(std::size(channel::kAll));
  SteadyTime time;
  LogEvent event;
  const auto total = static_cast<double>(std::max<std::int64_t>(1, index.reader_.size_bytes()));
  for (std::int64_t n = 0; index.reader_.next(&event); ++n) {
    if (n == 0) index.begin_ = event.stamp;
    const Duration now = time.at(event.stamp);
    const std::optional<std::size_t> channel = channel_index(event.channel);
    if (!channel) {
      ++index.foreign_;
      continue;
    }
    if (index.events_.size() >= std::numeric_limits<std::uint32_t>::max()) {
      return Error{path + ": more events than a viewer can hold (2^32)"};
    }
    const auto bytes = static_cast<std::int64_t>(28 + event.channel.size() + event.data.size());
    index.by_channel_[*channel].push_back(static_cast<std::uint32_t>(index.events_.size()));
    index.events_.push_back(
        {index.reader_.position_bytes() - bytes, now, static_cast<std::uint8_t>(*channel)});
    index.channels_ |= channel_bit(*channel);
    visit(event, now);
    if (n % 4096 == 0 && !progress(static_cast<double>(index.reader_.position_bytes()) / total)) {
      return Error{"interrupted"};
    }
  }
  if (!index.reader_.health().io_error.empty()) {
    return Error{path + ": " + index.reader_.health().io_error};
  }
  if (index.events_.empty()) {
    return Error{path + ": no message of this system; " + index.reader_.health().summary()};
  }
  if (!index.reader_.health().good()) index.damage_ = index.reader_.health().summary();
  return index;
}

std::size_t LogIndex::first_after(Duration time) const {
  const auto at = std::upper_bound(events_.begin(), events_.end(), time,
                                   [](Duration t, const Entry& e) { return t < e.time; });
  return static_cast<std::size_t>(at - events_.begin());
}

void LogIndex::add_recent(std::size_t channel, Duration time, Duration span,
                          std::vector<std::size_t>* out) const {
  const std::vector<std::uint32_t>& of_channel = by_channel_[channel];
  const auto end =
      std::upper_bound(of_channel.begin(), of_channel.end(), time,
                       [this](Duration t, std::uint32_t e) { return t < events_[e].time; });
  if (end == of_channel.begin()) return;
  // From the newest event of the channel, which may be old.
  const Duration from = events_[*std::prev(end)].time - span;
  auto begin = std::prev(end);
  while (begin != of_channel.begin() && events_[*std::prev(begin)].time > from) --begin;
  out->insert(out->end(), begin, end);
}

std::vector<std::size_t> LogIndex::state_at(Duration time, ChannelSet channels) const {
  std::vector<std::size_t> events;
  for (std::size_t c = 0; c < by_channel_.size(); ++c) {
    if ((channels & channel_bit(c)) == 0) continue;
    add_recent(c, time, state_span(c), &events);
  }
  std::sort(events.begin(), events.end());
  return events;
}

std::vector<std::size_t> LogIndex::recent(Duration time, Duration span, ChannelSet channels) const {
  std::vector<std::size_t> events;
  for (std::size_t c = 0; c < by_channel_.size(); ++c) {
    if ((channels & channel_bit(c)) == 0) continue;
    std::vector<std::size_t> of_channel;
    add_recent(c, time, span, &of_channel);
    // An old newest event stands alone.
    const auto old = std::find_if(of_channel.rbegin(), of_channel.rend(),
                                  [&](std::size_t e) { return events_[e].time <= time - span; });
    const auto begin = old == of_channel.rend() ? of_channel.begin() : old.base();
    if (begin == of_channel.end()) {
      if (!of_channel.empty()) events.push_back(of_channel.back());
    } else {
      events.insert(events.end(), begin, of_channel.end());
    }
  }
  std::sort(events.begin(), events.end());
  return events;
}

bool LogIndex::read(std::size_t event, LogEvent* out) {
  reader_.seek(events_[event].position);
  return reader_.next(out);
}

}  // namespace rcs::view
