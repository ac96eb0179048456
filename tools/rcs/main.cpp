// rcs: one command for logs, replays, simulations and figures.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "tools/rcs/command.h"

namespace rcs::tools {

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
  add_sureness_command(&app, &commands);
  add_import_commands(&app, &commands);
  add_map_commands(&app, &commands);
  add_register_command(&app, &commands);
  add_table1_command(&app, &commands);
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
  add_keys_command(&app, &commands);
  try {
    app.parse(argc, argv);
    check_numbers(app);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  for (const std::unique_ptr<Command>& command : commands) {
    if (command->chosen()) return command->run();
  }
  return kExitUsage;
}

}  // namespace
}  // namespace rcs::tools

// What is thrown, as memory or descriptors are exhausted, ends the process with its reason.
int main(int argc, char** argv) {
  try {
    return rcs::tools::rcs_main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rcs: %s\n", e.what());
    return 1;
  }
}
