#include "tools/drills/drill_scene.h"

#include <algorithm>
#include <utility>

#include "rcs/node/log/log_source.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"
#include "tools/drills/drill_stimulus.h"

namespace rcs::drills {
namespace {

class RecordedSource final : public EventSource {
 public:
  explicit RecordedSource(const Recording* recording) : recording_(recording) {}

  [[nodiscard]] Stamp peek() override {
    return next_ < recording_->size() ? recording_->due(next_) : Stamp::max();
  }
  void take(SourceEvent* event) override { recording_->copy(next_++, event); }

 private:
  const Recording* recording_;
  std::size_t next_ = 0;
};

/// A log with its reader.
class LoggedSource final : public EventSource {
 public:
  explicit LoggedSource(LogReader reader)
      : reader_(std::move(reader)), source_(&reader_, drive_channels()) {}

  [[nodiscard]] Stamp peek() override { return source_.peek(); }
  void take(SourceEvent* event) override { source_.take(event); }

 private:
  LogReader reader_;
  LogSource source_;
};

/// Another source, limited to a length, or until a stop is requested.
class CutSource final : public EventSource {
 public:
  CutSource(std::unique_ptr<EventSource> source, double length_s, std::function<bool()> stop)
      : source_(std::move(source)), stop_(std::move(stop)) {
    const Stamp first = source_->peek();
    if (length_s > 0.0 && first != Stamp::max()) end_ = first + from_seconds(length_s);
  }

  [[nodiscard]] Stamp peek() override {
    const Stamp due = source_->peek();
    return due < end_ && !stop_() ? due : Stamp::max();
  }
  void take(SourceEvent* event) override { source_->take(event); }

 private:
  std::unique_ptr<EventSource> source_;
  std::function<bool()> stop_;
  Stamp end_ = Stamp::max();
};

}  // namespace

void Recording::add(Stamp due, const SourceEvent& event) {
  const auto known = std::find(channels_.begin(), channels_.end(), event.channel);
  const auto channel = static_cast<std::size_t>(known - channels_.begin());
  if (known == channels_.end()) channels_.push_back(event.channel);
  items_.push_back({due, channel, bytes_.size(), event.data.size()});
  bytes_.insert(bytes_.end(), event.data.begin(), event.data.end());
}

void Recording::copy(std::size_t i, SourceEvent* event) const {
  const Item& item = items_[i];
  event->channel = channels_[item.channel];
  event->data.assign(bytes_.data() + item.begin, bytes_.data() + item.begin + item.size);
}

void Scene::add_user(double length_s) {
  ++users_;
  whole_ = whole_ || length_s <= 0.0;
  longest_s_ = std::max(longest_s_, length_s);
}

void Scene::done() {
  if (--users_ > 0) return;
  const std::lock_guard<std::mutex> lock(rendering_);
  recording_.reset();
  prior_maps_.clear();
  simulator_.reset();
}

const sim::PriorMap& Scene::prior_map(double cell_m) {
  const std::lock_guard<std::mutex> lock(rendering_);
  RCS_CHECK(simulator_ != nullptr);
  auto found = prior_maps_.find(cell_m);
  if (found == prior_maps_.end()) {
    found = prior_maps_.emplace(cell_m, simulator_->prior_map(cell_m)).first;
  }
  return found->second;
}

Result<std::unique_ptr<EventSource>> Scene::open(double length_s,
                                                 const std::function<bool()>& stop) {
  std::unique_ptr<EventSource> source;
  if (!key_.log.empty()) {
    Result<LogReader> reader = LogReader::open(key_.log);
    if (!reader) return reader.error();
    source = std::make_unique<LoggedSource>(std::move(reader).value());
  } else {
    const std::lock_guard<std::mutex> lock(rendering_);
    if (recording_ == nullptr) {
      if (Outcome rendered = render(stop); !rendered) return rendered.error();
    }
    source = std::make_unique<RecordedSource>(recording_.get());
  }
  return std::unique_ptr<EventSource>(
      std::make_unique<CutSource>(std::move(source), length_s, stop));
}

Outcome Scene::render(const std::function<bool()>& stop) {
  sim::ScenarioOverrides overrides;
  overrides.seed = key_.seed;
  overrides.ins_grade = key_.ins;
  if (!whole_) overrides.duration_s = longest_s_;
  const Result<sim::Scenario> scenario = sim::load_scenario(key_.scenario, overrides);
  if (!scenario) return scenario.error();
  if (scenario->commanded) {
    return Error{key_.scenario + ": the vehicle is commanded; drills require a scripted course"};
  }
  auto simulator = std::make_unique<sim::Simulator>(*scenario);
  auto recording = std::make_unique<Recording>();
  SourceEvent event;
  for (Stamp due = simulator->peek(); due != Stamp::max(); due = simulator->peek()) {
    simulator->take(&event);
    recording->add(due, event);
    if (stop()) return Error{"interrupted"};
  }
  recording_ = std::move(recording);
  simulator_ = std::move(simulator);
  return Done{};
}

}  // namespace rcs::drills
