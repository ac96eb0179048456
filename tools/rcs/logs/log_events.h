#pragma once
// What the commands of `rcs log` have in common.

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/recording/log_series.h"

namespace rcs::cli {

/// Calls `on_event` for every event of a log or a recording until it returns false.
/// @return exit status
template <class OnEvent>
int for_each_event(std::string_view command, const std::string& path, OnEvent on_event) {
  Result<recording::LogSeries> log = recording::LogSeries::open(path);
  if (!log) return fail(command, log.error());
  {
    const InterruptGuard interrupt;
    Progress progress(command, log->size_bytes());
    LogEvent event;
    while (log->next(&event)) {
      progress.at(log->position_bytes());
      if (interrupt.requested()) return fail(command, {"interrupted"});
      if (!on_event(event)) break;
    }
  }
  const LogHealth health = log->health();
  if (!health.good()) {
    fmt::print(stderr, "rcs {}: {}: {}\n", command, path, health.summary());
  }
  return kExitOk;
}

inline void add_log_option(CLI::App* app, std::string* path) {
  const CLI::Validator exists(
      [](std::string& name) {
        std::error_code error;
        return std::filesystem::exists(name, error) ? std::string()
                                                    : "File does not exist: " + name;
      },
      "FILE");
  app->add_option("LOG", *path, "LCM event log, or the folder of a recording")
      ->required()
      ->check(exists);
}

}  // namespace rcs::cli
