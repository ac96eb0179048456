// rcs: one command for logs, replays, simulations and their evaluation.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/command_line/parse.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/rcs/terminal.h"
#include "tools/recording/log_series.h"

namespace rcs::cli {

namespace {

int print_reason(std::string_view command, const Error& error, int status) {
  fmt::print(stderr, "rcs {}: {}\n", command, error.message);
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

/// Records the input files of the command line. @return an error if an output is one of them
Outcome protect_inputs(const CLI::App& app) {
  std::vector<std::string> outputs;
  for (const CLI::App* parsed = &app; parsed != nullptr;) {
    for (const CLI::Option* option : parsed->get_options()) {
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
  for (const std::string& path : outputs) {
    if (Outcome checked = tools::check_output(path); !checked) return checked;
  }
  return Done{};
}

/// What to do with the folder of a recording where a log is needed.
std::string advice_for(const std::string& folder) {
  if (!recording::LogSeries::open(folder)) return "";
  return fmt::format("the folder of a recording; make one log of it by `rcs log cut {} -o run.log`",
                     folder);
}

int rcs_main(int argc, char** argv) {
  CLI::App app("Operation, logs, maps, simulation and evaluation of the navigation system.", "rcs");
  app.require_subcommand(1);
  app.footer(
      std::string(kExitStatusHelp) +
      "\n"
      "Results go to stdout (--json: as JSON, see docs/user/json.md), messages to stderr.\n"
      "Nodes and simulator are programs of their own: sp, wm, bg, gateway, ros2_bridge, sim\n"
      "(`NAME --help`).");
  Commands commands;
  add_up_command(&app, &commands);
  add_top_command(&app, &commands);
  add_record_command(&app, &commands);
  add_log_commands(&app, &commands);
  add_go_command(&app, &commands);
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
  if (const auto ended = command_line::parse(&app, argc, argv, advice_for)) {
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
    rcs::tools::remove_temporaries_when_killed();
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
