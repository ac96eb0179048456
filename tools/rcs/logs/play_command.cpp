// rcs play

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/log/log_source.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/rcs/command.h"
#include "tools/rcs/logs/part_of_log.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kPlayName = "play";
constexpr Duration kListen = std::chrono::milliseconds(1200);  // every sensor publishes at >= 1 Hz

/// Detects other publishers of the channels that the player publishes.
class OtherPublishers {
 public:
  explicit OtherPublishers(Bus* bus) {
    for (std::size_t i = 0; i < received_.size(); ++i) {
      bus->subscribe(channel::kSensors[i], &received_[i]);
    }
  }
  /// The channels on which messages were received so far, separated by commas.
  [[nodiscard]] std::string channels() const {
    std::string names;
    for (std::size_t i = 0; i < received_.size(); ++i) {
      if (received_[i].any) {
        names += (names.empty() ? "" : ", ") + std::string(channel::kSensors[i]);
      }
    }
    return names;
  }

 private:
  struct Received final : Receiver {
    void receive(const std::uint8_t* /*data*/, std::size_t /*size*/,
                 Stamp /*arrival*/) noexcept override {
      any = true;
    }
    bool any = false;
  };
  std::array<Received, channel::kSensors.size()> received_;
};

/// Receives messages until `until`. @return false after Ctrl-C
bool wait_until(Stamp until, LiveTimeline* timeline) {
  Timeline::Step step = Timeline::Step::kDelivered;
  while (step == Timeline::Step::kDelivered) step = timeline->advance(until);
  return step != Timeline::Step::kEnded;
}

class Play final : public Command {
 public:
  explicit Play(CLI::App* rcs)
      : Command(rcs->add_subcommand("play",
                                    "Publish the sensor data of a log on the bus in real time")) {
    app()
        ->add_option("LOG", log_, "log with sensor channels")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--speed", speed_, "playback speed as a multiple of the recorded speed")
        ->check(CLI::Range(0.01, 100.0))
        ->capture_default_str();
    app()
        ->add_option("--from", from_s_, "begin, time after the first sensor event of the log [s]")
        ->check(CLI::Range(0.0, 1e9));
    CLI::Option* to =
        app()
            ->add_option("--to", to_s_,
                         "end, exclusive, time after the first sensor event of the log [s]")
            ->check(CLI::Range(0.0, 1e9));
    app()
        ->add_option("--duration", duration_s_, "length of the section that is played [s]")
        ->check(CLI::Range(0.0, 1e9))
        ->excludes(to);
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--json", json_, "print the results as JSON");
    std::string sensors;
    for (const char* name : channel::kSensors) sensors += std::string(name) + " ";
    app()->footer(
        "Publishes " + sensors +
        "and no other\nchannel, so that recorded commands do not reach the vehicle and recorded "
        "results do not\nmix with new ones. The messages keep their stamps. The command fails if "
        "one of these\nchannels already has a publisher on the bus. Ctrl-C stops the playback.\n"
        "Examples:\n"
        "  rcs play run.log\n"
        "  rcs play run.log --from 60 --duration 30 --speed 0.5");
  }

  int run() override {
    const Outcome done = play();
    return done ? kExitOk : fail(kPlayName, done.error());
  }

 private:
  [[nodiscard]] Outcome play() const {
    Result<LogReader> reader = LogReader::open(log_);
    if (!reader) return reader.error();
    const StopSignals stop;
    const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(lcm_url_);
    if (!bus) return bus.error();
    LiveTimeline timeline(bus->get(), &stop);
    const OtherPublishers others(bus->get());
    if (!wait_until(timeline.now() + kListen, &timeline)) return stopped(**bus, 0);
    if (const std::string names = others.channels(); !names.empty()) {
      return Error{fmt::format("{}: {} already published by another process: nothing was played",
                               (*bus)->url(), names)};
    }

    LogSource whole(&reader.value(), {channel::kSensors.begin(), channel::kSensors.end()});
    std::int64_t published = 0;
    Duration worst_late{};
    {
      PartOfLog source(kPlayName, &whole, from_seconds(from_s_), to(), &reader.value());
      const Stamp first = source.peek();
      const Stamp begin = timeline.now();
      SourceEvent event;
      for (Stamp due = first; due != Stamp::max(); due = source.peek()) {
        source.take(&event);
        const Stamp moment = begin + from_seconds(seconds(due - first) / speed_);
        if (!wait_until(moment, &timeline)) return stopped(**bus, published);
        worst_late = std::max(worst_late, timeline.now() - moment);
        (*bus)->publish(event.channel, event.data.data(), event.data.size());
        ++published;
      }
    }
    if (!reader->health().good()) {
      fmt::print(stderr, "rcs play: {}: {}\n", log_, reader->health().summary());
    }
    if (published == 0) return Error{log_ + ": no sensor data in the requested interval"};
    if (json_) {
      const report::Json json = {{"log", log_},
                                 {"url", (*bus)->url()},
                                 {"published", published},
                                 {"skipped", whole.passed_over()},
                                 {"max_delay_ms", milliseconds(worst_late)}};
      fmt::print("{}", report::json_document(kPlayName, json));
    } else {
      fmt::print(stderr,
                 "rcs play: {} messages published, maximum delay {:.1f} ms; {} messages of other "
                 "channels skipped\n",
                 published, milliseconds(worst_late), whole.passed_over());
    }
    return sound(**bus);
  }

  [[nodiscard]] Duration to() const {
    const double to_s = duration_s_ >= 0.0 ? from_s_ + duration_s_ : to_s_;
    return to_s < 1e10 ? from_seconds(to_s) : Duration::max();
  }

  [[nodiscard]] static Outcome stopped(const LcmBus& bus, std::int64_t published) {
    if (Outcome status = sound(bus); !status) return status;
    note_interrupt();
    return Error{fmt::format("stopped after {} messages", published)};
  }

  [[nodiscard]] static Outcome sound(const LcmBus& bus) {
    if (bus.publish_failures() > 0) {
      return Error{
          fmt::format("{}: {} messages could not be published", bus.url(), bus.publish_failures())};
    }
    return bus.status();
  }

  std::string log_;
  std::string lcm_url_;
  double speed_ = 1.0;
  double from_s_ = 0.0;
  double to_s_ = std::numeric_limits<double>::infinity();
  double duration_s_ = -1.0;
  bool json_ = false;
};

}  // namespace

void add_play_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Play>(rcs));
}

}  // namespace rcs::cli
