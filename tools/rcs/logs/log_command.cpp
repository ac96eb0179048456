// rcs log, and rcs log info | list | csv

#include <fmt/format.h>

#include <map>

#include "lcmtypes/channels.h"
#include "rcs/base/printable.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/time_text.h"
#include "tools/rcs/command.h"
#include "tools/rcs/logs/log_events.h"
#include "tools/rcs/logs/mcap_commands.h"
#include "tools/rcs/terminal.h"
#include "tools/recording/message_fields.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

struct ChannelMetrics {
  std::int64_t events = 0;
  std::int64_t bytes = 0;
  std::size_t largest_bytes = 0;
  Stamp first;
  Stamp last;
  bool known = false;
  std::int64_t malformed = 0;  ///< of a known channel, but not of its type
  std::int64_t last_seq = 0;
  std::int64_t missing = 0;   ///< in seq
  std::int64_t restarts = 0;  ///< seq begins at 1 again: another writer, or the writer restarted
  std::int64_t repeated = 0;  ///< seq repeats or steps back

  void add(const LogEvent& event) {
    if (events == 0) {
      first = event.stamp;
      known = recording::known_channel(event.channel);
    }
    ++events;
    bytes += static_cast<std::int64_t>(event.data.size());
    largest_bytes = std::max(largest_bytes, event.data.size());
    last = event.stamp;
    if (!known) return;
    const std::optional<recording::MessageHead> head =
        recording::read_head(event.channel, event.data);
    if (!head) {
      ++malformed;
      return;
    }
    if (last_seq != 0 && head->seq > last_seq + 1) missing += head->seq - last_seq - 1;
    if (last_seq != 0 && head->seq <= last_seq) ++(head->seq == 1 ? restarts : repeated);
    last_seq = head->seq;
  }

  [[nodiscard]] double rate_hz() const {
    return last > first ? static_cast<double>(events - 1) / seconds(last - first) : 0.0;
  }
};

int no_events(std::string_view command, const std::string& path) {
  return negative(command, Error{path + ": no events: not an LCM log, or empty"});
}

int log_info(const std::string& path, bool json) {
  Result<recording::LogSeries> log = recording::LogSeries::open(path);
  if (!log) return fail("log info", log.error());
  std::map<std::string, ChannelMetrics> channels;
  Stamp first;
  Stamp last;
  std::int64_t steps_back = 0;
  {
    const InterruptGuard interrupt;
    Progress progress("log info", log->size_bytes());
    LogEvent event;
    bool any = false;
    while (log->next(&event)) {
      progress.at(log->position_bytes());
      if (interrupt.requested()) return fail("log info", {"interrupted"});
      if (!any) first = last = event.stamp;
      any = true;
      if (event.stamp < last) ++steps_back;
      last = event.stamp;
      channels[event.channel].add(event);
    }
  }
  const LogHealth health = log->health();
  if (json) {
    report::Json out = {{"log", path},
                        {"bytes", log->size_bytes()},
                        {"events", health.events},
                        {"duration_s", seconds(last - first)},
                        {"first_utime", to_utime(first)},
                        {"stamps_stepping_back", steps_back},
                        {"skipped_bytes", health.skipped_bytes},
                        {"skips", health.skips},
                        {"truncated", health.truncated},
                        {"channels", report::Json::array()}};
    for (const auto& [name, c] : channels) {
      report::Json channel = {{"channel", name},
                              {"events", c.events},
                              {"rate_hz", c.rate_hz()},
                              {"bytes", c.bytes},
                              {"largest_bytes", c.largest_bytes},
                              {"known", c.known}};
      if (c.known) {
        channel["missing"] = c.missing;
        channel["repeated"] = c.repeated;
        channel["restarts"] = c.restarts;
        channel["malformed"] = c.malformed;
      }
      out["channels"].push_back(channel);
    }
    fmt::print("{}", report::json_document("log info", out));
    if (health.events == 0) return no_events("log info", path);
  } else {
    fmt::print("{}: {:.1f} MB, {:.3f} s, {}\n", path, static_cast<double>(log->size_bytes()) * 1e-6,
               seconds(last - first), health.summary());
    if (health.events == 0) return no_events("log info", path);
    fmt::print("first event: {} {} UTC\n", utc_date(to_utime(first)), time_of_day(to_utime(first)));
    if (steps_back > 0) fmt::print("the stamps step back {} times\n", steps_back);
    fmt::print("{:<18} {:>9} {:>9} {:>10} {:>9} {:>8} {:>8} {:>9}\n", "channel", "events", "Hz",
               "kB", "max B", "missing", "repeated", "malformed");
    for (const auto& [name, c] : channels) {
      fmt::print("{:<18} {:>9} {:>9.2f} {:>10.1f} {:>9}", printable(name), c.events, c.rate_hz(),
                 static_cast<double>(c.bytes) * 1e-3, c.largest_bytes);
      if (c.known) {
        fmt::print(" {:>8} {:>8} {:>9}{}\n", c.missing, c.repeated, c.malformed,
                   c.restarts > 0 ? fmt::format("  ({} restarts)", c.restarts) : "");
      } else {
        fmt::print("  (not a channel of this system)\n");
      }
    }
    fmt::print(
        "missing, repeated: sequence numbers left out or used again by the writer of a "
        "channel;\nmalformed: messages that are not of the type of the channel\n");
  }
  return health.good() && health.events > 0 ? kExitOk : kExitNegative;
}

/// The ids of the publisher, which follow the head in every type of this system.
/// @param head  of the event
/// @return nullopt if the message has none
std::optional<Publisher> publisher_of(const LogEvent& event,
                                      const std::optional<recording::MessageHead>& head) {
  constexpr std::size_t kAt = 24;
  if (!head || event.data.size() < kAt + 16) return std::nullopt;
  const auto id = [&event](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t k = at; k < at + 8; ++k) value = value << 8U | event.data[k];
    return static_cast<std::int64_t>(value);
  };
  return Publisher{id(kAt), id(kAt + 8), 0};
}

/// One event in a line, because a log may have millions.
int log_list_json(const std::string& path) {
  const auto text = [](const report::Json& value) {
    return value.dump(-1, ' ', false, report::Json::error_handler_t::replace);
  };
  bool first = true;
  // Not before the log is open: a command that cannot do its work prints no document.
  const auto print_head = [&] {
    fmt::print("{{\"schema\": {}, \"log\": {}, \"events\": [",
               text(report::schema_name("log list")), text(path));
  };
  const int status = for_each_event("log list", path, [&](const LogEvent& event) {
    const std::optional<recording::MessageHead> head =
        recording::read_head(event.channel, event.data);
    const std::optional<Publisher> publisher = publisher_of(event, head);
    if (first) print_head();
    fmt::print(
        "{}\n{}", first ? "" : ",",
        text({{"log_utime", to_utime(event.stamp)},
              {"number", event.number},
              {"channel", event.channel},
              {"bytes", event.data.size()},
              {"seq", head ? report::Json(head->seq) : report::Json()},
              {"utime", head ? report::Json(head->utime) : report::Json()},
              {"publisher_id",
               publisher ? report::Json(id_text(publisher->publisher_id)) : report::Json()},
              {"run_id", publisher ? report::Json(id_text(publisher->run_id)) : report::Json()}}));
    first = false;
    return true;
  });
  if (status != kExitOk) return status;  // interrupted: an incomplete list is not closed
  if (first) print_head();
  fmt::print("]}}\n");
  return first ? no_events("log list", path) : status;
}

int log_list(const std::string& path) {
  fmt::print("{:<12} {:>11} {:>7} {:<18} {:>6} {:>6} {:>16} {:>16}\n", "UTC", "run [s]", "event",
             "channel", "bytes", "seq", "utime [us]", "publisher");
  std::optional<Stamp> first;
  const int status = for_each_event("log list", path, [&first](const LogEvent& event) {
    if (!first) first = event.stamp;
    const std::optional<recording::MessageHead> head =
        recording::read_head(event.channel, event.data);
    const std::optional<Publisher> publisher = publisher_of(event, head);
    fmt::print("{:<12} {:11.6f} {:>7} {:<18} {:>6} {:>6} {:>16} {:>16}\n",
               time_of_day(to_utime(event.stamp)), seconds(event.stamp - *first), event.number,
               printable(event.channel), event.data.size(), head ? std::to_string(head->seq) : "-",
               head ? std::to_string(head->utime) : "-",
               publisher ? id_text(publisher->publisher_id) : "-");
    return true;
  });
  return status == kExitOk && !first ? no_events("log list", path) : status;
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

int log_csv(const std::string& path, const std::string& channel) {
  if (!recording::known_channel(channel)) {
    fmt::print(stderr, "rcs log csv: {} is not a channel of this system\n", channel);
    return kExitUsage;
  }
  std::int64_t rows = 0;
  std::int64_t malformed = 0;
  const int status = for_each_event("log csv", path, [&](const LogEvent& event) {
    if (event.channel != channel) return true;
    const std::optional<recording::Fields> fields = recording::read_fields(channel, event.data);
    if (!fields) {
      ++malformed;
      return true;
    }
    std::string line = rows == 0 ? "log_utime" : "";
    if (rows == 0) {
      for (const auto& [name, value] : *fields) line += "," + name;
      line += "\n";
    }
    line += std::to_string(to_utime(event.stamp));
    for (const auto& [name, value] : *fields) line += "," + csv_cell(printable(value));
    fmt::print("{}\n", line);
    ++rows;
    return true;
  });
  if (status != kExitOk) return status;
  if (malformed > 0) fmt::print(stderr, "rcs log csv: {} messages not decodable\n", malformed);
  return rows > 0 ? kExitOk : fail("log csv", {path + ": no message on " + channel});
}

class LogInfo final : public Command {
 public:
  explicit LogInfo(CLI::App* log)
      : Command(log->add_subcommand(
            "info", "Print channels, counts, rates, sizes, gaps and damage of a log")) {
    add_log_option(app(), &log_);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Exit status 1 if the log is damaged or empty; its readable part is evaluated. A log that\n"
        "ends inside an event (truncated) was not closed, e.g. because the power failed: all\n"
        "events before are read.\n"
        "Examples:\n"
        "  rcs log info run.log\n"
        "  rcs log info recording/      all segments of a recording as one log");
  }
  int run() override { return log_info(log_, json_); }

 private:
  std::string log_;
  bool json_ = false;
};

class LogList final : public Command {
 public:
  explicit LogList(CLI::App* log)
      : Command(log->add_subcommand("list", "Print one line per event")) {
    add_log_option(app(), &log_);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "UTC is the time of day of the stamp of the log, run [s] the time since its first event;\n"
        "utime [us] is the time in the message: sensor time (arbitrary epoch) or node time;\n"
        "publisher is the hexadecimal id of the process, as in events and `rcs top`.\n"
        "Example:  rcs log list run.log | head");
  }
  int run() override { return json_ ? log_list_json(log_) : log_list(log_); }

 private:
  std::string log_;
  bool json_ = false;
};

class LogCsv final : public Command {
 public:
  explicit LogCsv(CLI::App* log)
      : Command(log->add_subcommand("csv", "Print the messages of a channel as CSV")) {
    add_log_option(app(), &log_);
    app()
        ->add_option("--channel", channel_, "channel to print, e.g. WM_NAV_STATE")
        ->type_name("CHANNEL")
        ->required();
    app()->footer(
        "Arrays of fixed length become one column per entry; for points, tiles and stages only\n"
        "their number is written.\n"
        "Example:  rcs log csv run.log --channel SP_REGISTRATION > registrations.csv");
  }
  int run() override { return log_csv(log_, channel_); }

 private:
  std::string log_;
  std::string channel_;
};

}  // namespace

void add_log_commands(CLI::App* rcs, Commands* commands) {
  CLI::App* log = rcs->add_subcommand("log", "Inspect, cut and export LCM event logs");
  log->require_subcommand(1);
  commands->push_back(std::make_unique<LogInfo>(log));
  commands->push_back(std::make_unique<LogList>(log));
  add_log_cut_command(log, commands);
  commands->push_back(std::make_unique<LogCsv>(log));
  add_log_mcap_command(log, commands);
}

}  // namespace rcs::cli
