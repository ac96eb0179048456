// rcs log cut

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/text.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/params/param_text.h"
#include "rcs/node/time_text.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/logs/log_events.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kCutName = "log cut";

struct CutOptions {
  std::string log;
  std::string out;
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
  std::string around;                 ///< code of an event; empty: from_s to to_s
  int occurrence = 1;                 ///< of the event; negative: from the last one
  double before_s = 10.0;             ///< the event
  double after_s = 10.0;              ///< the event
  std::vector<std::string> channels;  ///< empty: all
  bool json = false;
};

/// An occurrence of an event in a log.
struct Occurrence {
  Stamp stamp;
  std::string node;
};

/// The section to copy; the end is exclusive.
struct Section {
  Stamp from = Stamp::min();
  Stamp to = Stamp::max();
};

std::vector<std::string> known_events() {
  std::vector<std::string> codes;
  for (const event::Info* e : event::kAll) codes.emplace_back(e->code);
  return codes;
}

/// @return nullopt: the event is another one
std::optional<Occurrence> occurrence_in(const LogEvent& event, const std::string& code,
                                        event_t* message) {
  if (!ends_with(event.channel, "_EVENT")) return std::nullopt;
  const int size = static_cast<int>(event.data.size());
  if (message->decode(event.data.data(), 0, size) != size || message->code != code) {
    return std::nullopt;
  }
  const std::string channel = event.channel;
  return Occurrence{event.stamp, channel.substr(0, channel.size() - 6)};
}

Stamp limited_sum(Stamp stamp, double s) {
  const Duration d = from_seconds(s);
  return d >= kMaxDuration ? Stamp::max() : stamp + d;
}

class LogCut final : public Command {
 public:
  explicit LogCut(CLI::App* log)
      : Command(log->add_subcommand("cut", "Copy a section of a log to another log")) {
    add_log_option(app(), &options_.log);
    app()->add_option("-o,--out", options_.out, "output log")->type_name("FILE")->required();
    CLI::Option* from =
        app()->add_option("--from", options_.from_s,
                          "begin of the section, time after the first event of the log [s]");
    CLI::Option* to = app()->add_option(
        "--to", options_.to_s,
        "end of the section, exclusive, time after the first event of the log [s]");
    CLI::Option* around =
        app()
            ->add_option("--around", options_.around,
                         "code of an event, e.g. fde: copy the time around its first occurrence")
            ->type_name("EVENT")
            ->excludes(from)
            ->excludes(to);
    app()
        ->add_option("--occurrence", options_.occurrence,
                     "which occurrence of the event; -1 is the last one")
        ->needs(around)
        ->check(CLI::Range(-1'000'000, 1'000'000))
        ->capture_default_str();
    for (const auto& [name, value] :
         {std::pair("--before", &options_.before_s), std::pair("--after", &options_.after_s)}) {
      app()
          ->add_option(name, *value, fmt::format("time {} the event [s]", name + 2))
          ->needs(around)
          ->check(CLI::Range(0.0, 1e9))
          ->capture_default_str();
    }
    add_list(app(), "--channel", &options_.channels, "only these channels")
        ->type_name("CHANNEL")
        ->excludes(app()->add_flag("--sensors", sensors_, "only the sensor channels"));
    app()->add_flag("--json", options_.json, "print the results as JSON");
    app()->footer(
        "LOG may be the folder of a recording (`rcs record`): its segments are read as one log,\n"
        "also while it is recorded. Without a section the whole recording becomes one log.\n"
        "Exit status 1 if the event of --around does not occur in the log. "
        "docs/reference/events.md\n"
        "lists all events.\n"
        "A log with sensor channels alone contains no commands (BG_COMMAND, BG_DRIVE) and may be\n"
        "played to live nodes by any player, e.g. lcm-logplayer. Ctrl-C leaves no partial copy\n"
        "behind.\n"
        "Examples:\n"
        "  rcs log cut run.log --from 60 --to 90 -o part.log\n"
        "  rcs log cut recording/ -o run.log\n"
        "  rcs log cut recording/ --around solution.lost --before 30 --after 5 -o lost.log\n"
        "  rcs log cut run.log --around stop.engaged --occurrence -1 -o last_stop.log\n"
        "  rcs log cut run.log --sensors -o sensors.log\n"
        "  rcs log cut run.log --channel SP_REGISTRATION,WM_NAV_STATE -o results.log");
  }

  int run() override {
    if (sensors_) options_.channels = {channel::kSensors.begin(), channel::kSensors.end()};
    if (options_.around.empty()) return copy();
    const std::vector<std::string> known = known_events();
    if (std::find(known.begin(), known.end(), options_.around) == known.end()) {
      return wrong_usage(kCutName,
                         Error{fmt::format("--around {}: no such event{}; see "
                                           "docs/reference/events.md",
                                           options_.around, suggestion(options_.around, known))});
    }
    if (options_.occurrence == 0) {
      return wrong_usage(kCutName, Error{"--occurrence 0: the first is 1, the last -1"});
    }
    const int status = find();
    return status == kExitOk ? copy() : status;
  }

 private:
  [[nodiscard]] int find();
  [[nodiscard]] int copy();
  [[nodiscard]] bool wants(const LogEvent& event) const;

  CutOptions options_;
  bool sensors_ = false;
  Section section_;
  std::vector<Occurrence> found_;  // of the event of --around
  std::size_t chosen_ = 0;         // of found_
};

/// Finds the event of --around and sets the section. @return exit status
int LogCut::find() {
  event_t message{};
  const int status = for_each_event(kCutName, options_.log, [&](const LogEvent& event) {
    const std::optional<Occurrence> found = occurrence_in(event, options_.around, &message);
    if (found) found_.push_back(*found);
    return true;
  });
  if (status != kExitOk) return status;
  const auto count = static_cast<std::int64_t>(found_.size());
  const std::int64_t index =
      options_.occurrence > 0 ? options_.occurrence - 1 : count + options_.occurrence;
  if (index < 0 || index >= count) {
    if (options_.json) {
      fmt::print("{}", report::json_document(kCutName, {{"log", nullptr},
                                                        {"events", 0},
                                                        {"around",
                                                         {{"event", options_.around},
                                                          {"log_utime", nullptr},
                                                          {"occurrence", nullptr},
                                                          {"occurrences", count}}}}));
    }
    return negative(
        kCutName,
        Error{count == 0
                  ? fmt::format("{}: the event {} does not occur", options_.log, options_.around)
                  : fmt::format("{}: the event {} occurs {} times, there is "
                                "no occurrence {}",
                                options_.log, options_.around, count, options_.occurrence)});
  }
  chosen_ = static_cast<std::size_t>(index);
  const Occurrence& chosen = found_[chosen_];
  section_.from = chosen.stamp - from_seconds(options_.before_s);
  // The event itself is in the section, also with --after 0.
  section_.to = chosen.stamp + from_seconds(options_.after_s) + Duration(1);
  fmt::print(stderr, "rcs log cut: {} of {}: occurrence {} of {}, {} {} UTC\n", options_.around,
             chosen.node, chosen_ + 1, count, utc_date(to_utime(chosen.stamp)),
             time_of_day(to_utime(chosen.stamp)));
  return kExitOk;
}

bool LogCut::wants(const LogEvent& event) const {
  const std::vector<std::string>& channels = options_.channels;
  return event.stamp >= section_.from && event.stamp < section_.to &&
         (channels.empty() ||
          std::find(channels.begin(), channels.end(), event.channel) != channels.end());
}

int LogCut::copy() {
  tools::OutputFile out(options_.out);
  if (Outcome checked = out.check(); !checked) return fail(kCutName, checked.error());
  Result<LogWriter> writer = LogWriter::create(out.write_path());
  if (!writer) return fail(kCutName, writer.error());
  bool first = options_.around.empty();
  Outcome written = Done{};
  const int status = for_each_event(kCutName, options_.log, [&](const LogEvent& event) {
    if (first) {
      section_ = {limited_sum(event.stamp, options_.from_s),
                  limited_sum(event.stamp, options_.to_s)};
    }
    first = false;
    if (wants(event)) {
      written = writer->write(event.stamp, event.channel, event.data.data(), event.data.size());
    }
    return written.ok();
  });
  if (status != kExitOk) return status;
  if (written) written = writer->close();
  if (written && writer->events() == 0) {
    written = Error{"no event in the requested interval and channels"};
  }
  if (written) written = out.commit();
  if (!written) return fail(kCutName, written.error());
  if (!options_.json) {
    fmt::print(stderr, "{}: {} events\n", options_.out, writer->events());
    return kExitOk;
  }
  report::Json done = {{"log", options_.out}, {"events", writer->events()}};
  if (!options_.around.empty()) {
    done["around"] = {{"event", options_.around},
                      {"log_utime", to_utime(found_[chosen_].stamp)},
                      {"occurrence", chosen_ + 1},
                      {"occurrences", found_.size()}};
  }
  fmt::print("{}", report::json_document(kCutName, done));
  return kExitOk;
}

}  // namespace

void add_log_cut_command(CLI::App* log, Commands* commands) {
  commands->push_back(std::make_unique<LogCut>(log));
}

}  // namespace rcs::cli
