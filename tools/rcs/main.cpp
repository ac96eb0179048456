// rcs: one command for logs, replays, simulations and their evaluation.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "rcs/base/input_files.h"
#include "rcs/command_line/parse.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/rcs/standard_streams.h"
#include "tools/rcs/terminal.h"
#include "tools/recording/log_series.h"

namespace rcs::cli {

namespace {

namespace fs = std::filesystem;

/// A message without the ends of the names of temporaries (OutputFile): they are internal.
std::string without_temporaries(std::string message) {
  const std::string end = fmt::format(".{}.partial", ::getpid());
  for (std::size_t at = message.find(end); at != std::string::npos; at = message.find(end, at)) {
    message.erase(at, end.size());
  }
  return message;
}

int print_reason(std::string_view command, const Error& error, int status) {
  fmt::print(stderr, "rcs {}: {}\n", command, without_temporaries(error.message));
  return status;
}

}  // namespace

int fail(std::string_view command, const Error& error) {
  return print_reason(command, error, kExitInput);
}

int negative(std::string_view command, const Error& reason) {
  return print_reason(command, reason, kExitNegative);
}

int wrong_usage(std::string_view command, const Error& error) {
  return print_reason(command, error, kExitUsage);
}

namespace {

/// Options that name output files. Every other argument that names a file is an input.
constexpr std::array<std::string_view, 10> kOutputs = {
    "out",     "svg",     "report",    "export",    "plot",
    "picture", "geotiff", "hillshade", "prior-map", "logs"};

bool names_output(const CLI::Option& option) {
  const std::vector<std::string>& names = option.get_lnames();
  return !names.empty() &&
         std::find(kOutputs.begin(), kOutputs.end(), names.front()) != kOutputs.end();
}

/// Records the input files of the command line. @return an error if an output is one of them, or
/// if two outputs are one file
Outcome protect_inputs(const CLI::App& app) {
  std::vector<std::string> outputs;
  for (const CLI::App* parsed = &app; parsed != nullptr;) {
    for (const CLI::Option* option : parsed->get_options()) {
      if (option->get_items_expected_max() == 0) continue;  // a flag
      for (const std::string& value : option->results()) {
        if (names_output(*option)) {
          outputs.push_back(value);
        } else {
          tools::note_input(value);
        }
      }
    }
    const std::vector<CLI::App*> below = parsed->get_subcommands();
    parsed = below.empty() ? nullptr : below.front();
  }
  std::set<fs::path> names;
  for (const std::string& path : outputs) {
    if (Outcome checked = tools::check_output(path); !checked) return checked;
    std::error_code error;
    const fs::file_status there = fs::status(path, error);
    // Several outputs may go to /dev/null.
    if (fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there)) continue;
    fs::path name = fs::weakly_canonical(fs::absolute(path, error), error);
    if (!name.has_filename()) name = name.parent_path();  // "folder/"
    if (!names.insert(name).second) {
      return Error{path + ": is the name of two outputs of this command: nothing is written"};
    }
  }
  return Done{};
}

/// What to do with the folder of a recording where a log is needed.
std::string advice_for(const std::string& folder) {
  if (!recording::LogSeries::open(folder)) return "";
  return fmt::format("the folder of a recording; make one log of it by `rcs log cut {} -o run.log`",
                     folder);
}

/// "rcs help log cut" as "rcs log cut --help".
std::vector<const char*> without_help_command(int argc, const char* const* argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc < 2 || std::string_view(argv[1]) != "help") return words;
  words.erase(words.begin() + 1);
  words.push_back("--help");
  return words;
}

int rcs_main(int argc, char** argv) {
  CLI::App app("Operation, logs, maps, simulation and evaluation of the navigation system.", "rcs");
  app.require_subcommand(1);
  app.footer(
      std::string(kExitStatusHelp) +
      "\n"
      "Results go to stdout (--json: as JSON, see docs/user/json.md), messages to stderr.\n"
      "Nodes and simulator are programs of their own: sp, wm, bg, mission, gateway, ros2_bridge,\n"
      "sim (`NAME --help`).");
  Commands commands;
  add_up_command(&app, &commands);
  add_top_command(&app, &commands);
  add_record_command(&app, &commands);
  add_log_commands(&app, &commands);
  add_go_command(&app, &commands);
  add_mission_command(&app, &commands);
  add_predict_command(&app, &commands);
  add_import_commands(&app, &commands);
  add_map_commands(&app, &commands);
  add_register_command(&app, &commands);
  add_table1_command(&app, &commands);
  add_play_command(&app, &commands);
  add_replay_command(&app, &commands);
  add_budget_command(&app, &commands);
  add_load_command(&app, &commands);
  add_drill_command(&app, &commands);
  add_drive_command(&app, &commands);
  add_faults_command(&app, &commands);
  add_consistency_command(&app, &commands);
  add_outages_command(&app, &commands);
  add_smooth_command(&app, &commands);
  add_why_command(&app, &commands);
  add_view_command(&app, &commands);
  add_eval_command(&app, &commands);
  add_sim_command(&app, &commands);
  add_report_command(&app, &commands);
  add_config_commands(&app, &commands);
  add_keys_command(&app, &commands);
  add_reference_commands(&app, &commands);
  note_command_line(argc, argv);
  const std::vector<const char*> words = without_help_command(argc, argv);
  if (const auto ended =
          command_line::parse(&app, static_cast<int>(words.size()), words.data(), advice_for)) {
    return command_line::print(*ended);
  }
  if (const Outcome safe = protect_inputs(app); !safe) {
    return fail(app.get_subcommands().front()->get_name(), safe.error());
  }
  for (const std::unique_ptr<Command>& command : commands) {
    if (!command->chosen()) continue;
    const int status = command->run();
    return status != kExitOk && was_interrupted() ? kExitInterrupted : status;
  }
  return kExitUsage;
}

}  // namespace
}  // namespace rcs::cli

// An exception, e.g. when memory or descriptors are exhausted, ends the process with its message.
int main(int argc, char** argv) {
  try {
    rcs::cli::open_standard_streams();
    rcs::cli::protect_messages();
    rcs::tools::remove_temporaries_when_killed();
    rcs::observe_inputs(rcs::tools::note_input);
    const int status = rcs::cli::rcs_main(argc, argv);
    // Buffered output may not fit on a full disk.
    std::cout.flush();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout) return status;
    std::fprintf(stderr, "rcs: cannot write to standard output: %s\n", std::strerror(errno));
    return rcs::kExitInput;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rcs: %s\n", e.what());
    return rcs::kExitInput;
  }
}
