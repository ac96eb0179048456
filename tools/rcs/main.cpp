// rcs: one command for logs, replays, simulations and figures.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "tools/base/files.h"
#include "tools/rcs/command.h"

namespace rcs::cli {

int fail(std::string_view command, const Error& error) {
  fmt::print(stderr, "rcs {}: {}\n", command, error.message);
  return kExitFailed;
}

namespace {

/// CLI11 takes "nan" for a number in any range. @throws CLI::ValidationError
void check_numbers(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_type_name().find("FLOAT") == std::string::npos) continue;
    for (const std::string& text : option->results()) {
      char* end = nullptr;
      const double number = std::strtod(text.c_str(), &end);
      if (end != text.c_str() && !std::isfinite(number)) {
        throw CLI::ValidationError(option->get_name(), text + " is not a finite number");
      }
    }
  }
  for (const CLI::App* chosen : command.get_subcommands()) check_numbers(*chosen);
}

/// Options whose values are written. Every other argument that names a file is an input.
constexpr std::array<std::string_view, 10> kOutputs = {
    "out",     "svg",     "report",    "export",    "plot",
    "picture", "geotiff", "hillshade", "prior-map", "logs"};

bool names_output(const CLI::Option& option) {
  const std::vector<std::string>& names = option.get_lnames();
  return !names.empty() &&
         std::find(kOutputs.begin(), kOutputs.end(), names.front()) != kOutputs.end();
}

/// Remembers the files of the command line that are read. @return an error if one is also written
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

int rcs_main(int argc, char** argv) {
  CLI::App app(
      "Tools of the registration and navigation system: logs, imports, replays,\n"
      "simulations and their evaluation.",
      "rcs");
  app.require_subcommand(1);
  app.footer(
      "Exit status: 0 done; 1 failed, or the answer is no; 2 wrong usage.\n"
      "Figures go to stdout (--json where offered), messages to stderr.\n"
      "`rcs COMMAND --help` has examples.");
  Commands commands;
  add_up_command(&app, &commands);
  add_top_command(&app, &commands);
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
  add_consistency_command(&app, &commands);
  add_outages_command(&app, &commands);
  add_truth_command(&app, &commands);
  add_why_command(&app, &commands);
  add_eval_command(&app, &commands);
  add_sim_command(&app, &commands);
  add_report_command(&app, &commands);
  add_config_commands(&app, &commands);
  add_keys_command(&app, &commands);
  try {
    app.parse(argc, argv);
    check_numbers(app);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  if (const Outcome safe = protect_inputs(app); !safe) {
    return fail(app.get_subcommands().front()->get_name(), safe.error());
  }
  for (const std::unique_ptr<Command>& command : commands) {
    if (command->chosen()) return command->run();
  }
  return kExitUsage;
}

}  // namespace
}  // namespace rcs::cli

// What is thrown, as memory or descriptors are exhausted, ends the process with its reason.
int main(int argc, char** argv) {
  try {
    rcs::tools::remove_temporaries_when_killed();
    const int status = rcs::cli::rcs_main(argc, argv);
    // What is still in the buffers may not fit on a full disk.
    std::cout.flush();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout) return status;
    std::fprintf(stderr, "rcs: cannot write to standard output: %s\n", std::strerror(errno));
    return rcs::cli::kExitFailed;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rcs: %s\n", e.what());
    return 1;
  }
}
