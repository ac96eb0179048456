#include "tools/drills/drill_scene.h"

#include <algorithm>
#include <utility>

#include "rcs/node/log/log_source.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"
#include "tools/drills/drill_stimulus.h"

namespace rcs::drills {
namespace {

/// Rendering takes about this share of the time of the first run of a scene.
constexpr double kRenderingShare = 0.3;

/// A source that knows how much of it was taken.
class SceneSource : public EventSource {
 public:
  [[nodiscard]] virtual double share() const = 0;
};

class RecordedSource final : public SceneSource {
 public:
  explicit RecordedSource(const Recording* recording) : recording_(recording) {}

  [[nodiscard]] Stamp peek() override {
    return next_ < recording_->size() ? recording_->due(next_) : Stamp::max();
  }
  void take(SourceEvent* event) override { recording_->copy(next_++, event); }
  [[nodiscard]] double share() const override {
    return static_cast<double>(next_) / static_cast<double>(recording_->size());
  }

 private:
  const Recording* recording_;
  std::size_t next_ = 0;
};

/// A log with its reader.
class LoggedSource final : public SceneSource {
 public:
  explicit LoggedSource(LogReader reader)
      : reader_(std::move(reader)), source_(&reader_, drive_channels()) {}

  [[nodiscard]] Stamp peek() override { return source_.peek(); }
  void take(SourceEvent* event) override { source_.take(event); }
  [[nodiscard]] double share() const override {
    return static_cast<double>(reader_.position_bytes()) /
           static_cast<double>(reader_.size_bytes());
  }

 private:
  LogReader reader_;
  LogSource source_;
};

/// Another source, limited to a length, or until a stop is requested.
class CutSource final : public EventSource {
 public:
  /// @param rendered  the share of the progress before the source is read
  CutSource(std::unique_ptr<SceneSource> source, double length_s, std::function<bool()> stop,
            std::function<void(double)> progress, double rendered)
      : source_(std::move(source)),
        stop_(std::move(stop)),
        progress_(std::move(progress)),
        rendered_(rendered),
        first_(source_->peek()) {
    if (length_s > 0.0 && first_ != Stamp::max()) end_ = first_ + from_seconds(length_s);
  }

  [[nodiscard]] Stamp peek() override {
    const Stamp due = source_->peek();
    return due < end_ && !stop_() ? due : Stamp::max();
  }
  void take(SourceEvent* event) override {
    if (progress_) progress_(rendered_ + (1.0 - rendered_) * share());
    source_->take(event);
  }

 private:
  [[nodiscard]] double share() {
    const double of_all = source_->share();
    if (end_ == Stamp::max()) return of_all;
    return std::max(of_all, seconds(source_->peek() - first_) / seconds(end_ - first_));
  }

  std::unique_ptr<SceneSource> source_;
  std::function<bool()> stop_;
  std::function<void(double)> progress_;
  double rendered_;
  Stamp first_;
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

Result<std::unique_ptr<EventSource>> Scene::open(double length_s, const std::function<bool()>& stop,
                                                 const std::function<void(double)>& progress) {
  std::unique_ptr<SceneSource> source;
  double rendered = 0.0;
  if (!key_.log.empty()) {
    Result<LogReader> reader = LogReader::open(key_.log);
    if (!reader) return reader.error();
    source = std::make_unique<LoggedSource>(std::move(reader).value());
  } else {
    const std::lock_guard<std::mutex> lock(rendering_);
    if (recording_ == nullptr) {
      rendered = kRenderingShare;
      if (Outcome done = render(stop, progress); !done) return done.error();
    }
    source = std::make_unique<RecordedSource>(recording_.get());
  }
  return std::unique_ptr<EventSource>(
      std::make_unique<CutSource>(std::move(source), length_s, stop, progress, rendered));
}

Outcome Scene::render(const std::function<bool()>& stop,
                      const std::function<void(double)>& progress) {
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
    if (progress) {
      progress(kRenderingShare * seconds(due - sim::Simulator::kStart) /
               seconds(simulator->end() - sim::Simulator::kStart));
    }
    if (stop()) return Error{"interrupted"};
  }
  recording_ = std::move(recording);
  simulator_ = std::move(simulator);
  return Done{};
}

}  // namespace rcs::drills
