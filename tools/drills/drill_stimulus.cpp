#include "tools/drills/drill_stimulus.h"

#include <cmath>
#include <utility>

#include "lcmtypes/channels.h"
#include "tools/drills/drill_content.h"

namespace rcs::drills {
namespace {

bool is_sensor(std::string_view channel) { return publishes_on(DrillSource::kAll, channel); }

}  // namespace

std::vector<std::string> drive_channels() {
  std::vector<std::string> channels{channel::kSimTruth};
  channels.insert(channels.end(), channel::kSensors.begin(), channel::kSensors.end());
  return channels;
}

StimulatedSource::StimulatedSource(EventSource* source, const std::vector<Stimulus>& stimuli,
                                   std::uint64_t seed)
    : source_(source) {
  for (std::size_t k = 0; k < stimuli.size(); ++k) {
    std::seed_seq sequence{seed, static_cast<std::uint64_t>(k)};
    active_.push_back({stimuli[k], {std::mt19937_64(sequence), 0, {}}, {}});
  }
}

Stamp StimulatedSource::peek() {
  read_ahead();
  return ready_.empty() ? Stamp::max() : ready_.begin()->first;
}

void StimulatedSource::take(SourceEvent* event) {
  read_ahead();
  RCS_CHECK(!ready_.empty());
  std::swap(*event, ready_.begin()->second);
  ready_.erase(ready_.begin());
}

// Reads on until no later message can be due before the first that is ready.
void StimulatedSource::read_ahead() {
  while (true) {
    const Stamp due = source_->peek();
    if (due == Stamp::max()) return release_held();
    if (!ready_.empty() && ready_.begin()->first < due) return;
    SourceEvent event;
    source_->take(&event);
    if (!begin_ && is_sensor(event.channel)) begin_ = due;
    pass(std::move(event), due);
  }
}

/// Messages that still wait for a successor at the end of the stream are released last.
void StimulatedSource::release_held() {
  const Stamp last = ready_.empty() ? begin_.value_or(Stamp()) : ready_.rbegin()->first;
  for (Active& a : active_) {
    if (a.held) ready_.emplace(last, std::move(*a.held));
    a.held.reset();
  }
}

void StimulatedSource::pass(SourceEvent event, Stamp due) {
  const double time_s = begin_ ? seconds(due - *begin_) : -1.0;
  std::vector<SourceEvent> after;      // released after this one
  std::vector<double> again_after_ms;  // of what the other stimuli make of it
  Stamp arrival = due;
  for (Active& a : active_) {
    const Stimulus& s = a.stimulus;
    if (!s.holds(time_s) || !publishes_on(s.source, event.channel)) continue;
    const double since_s = time_s - s.begin_s;
    switch (s.kind) {
      case StimulusKind::kDropout:
        return;
      case StimulusKind::kFlapping:
        if (std::fmod(since_s, s.on_s + s.off_s) >= s.on_s) return;
        break;
      case StimulusKind::kDelay:
        arrival += from_milliseconds(s.delay_ms);
        break;
      case StimulusKind::kRepeat:
        again_after_ms.push_back(s.delay_ms);
        break;
      case StimulusKind::kReorder:
        if (!a.held) {
          a.held = std::move(event);
          return;
        }
        after.push_back(std::move(*a.held));
        a.held.reset();
        break;
      default:
        change_content(s, since_s, &a.content, &event);
        break;
    }
  }
  for (const double ms : again_after_ms) ready_.emplace(arrival + from_milliseconds(ms), event);
  ready_.emplace(arrival, std::move(event));
  for (SourceEvent& held : after) ready_.emplace(arrival, std::move(held));
}

}  // namespace rcs::drills
