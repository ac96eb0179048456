// rcs: one command for logs, replays, simulations and their evaluation.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
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

#include "rcs/base/text.h"
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

/// A file or a folder of the command line does not exist: an input, although CLI11 checks it.
bool names_missing_input(const CLI::ParseError& error) {
  if (error.get_exit_code() != static_cast<int>(CLI::ExitCodes::ValidationError)) return false;
  const std::string_view text = error.what();
  return text.find(" does not exist: ") != std::string_view::npos ||
         text.find(" is actually a ") != std::string_view::npos;
}

/// "map info" of `rcs map info ...`.
std::string words_of(const CLI::App& app) {
  std::string words;
  for (const CLI::App* parsed = &app; !parsed->get_subcommands().empty();) {
    parsed = parsed->get_subcommands().front();
    words += (words.empty() ? "" : " ") + parsed->get_name();
  }
  return words;
}

/// "RUN: File does not exist: a.log" as the commands report it: "a.log: file does not exist".
std::string missing_text(const CLI::ParseError& error) {
  std::string text = error.what();
  const std::size_t path = text.rfind(": ");
  const std::size_t problem = text.rfind(": ", path - 1);
  if (path == std::string::npos || problem == std::string::npos) return text;
  std::string reason = text.substr(problem + 2, path - problem - 2);
  reason[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(reason[0])));
  const std::string file = text.substr(path + 2);
  if (reason == "file is actually a directory" && recording::LogSeries::open(file)) {
    return fmt::format(
        "{}: the folder of a recording; make one log of it by `rcs log cut {} -o run.log`", file,
        file);
  }
  return file + ": " + reason;
}

/// Help of at most 100 columns.
class HelpFormat final : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return entry(make_option_name(option, is_positional) + make_option_opts(option),
                 make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return entry(command->get_name(), command->get_description());
  }

 private:
  static std::string entry(const std::string& name, std::string text) {
    constexpr std::size_t kIndent = 30;
    std::replace(text.begin(), text.end(), '\n', ' ');
    std::string head = fmt::format("  {:<{}}", name, kIndent - 2);
    if (head.size() > kIndent) head += "\n" + std::string(kIndent, ' ');
    // The head has the place of the dots.
    const std::string dots(kIndent, '.');
    return head + wrapped(dots + text, kIndent).substr(kIndent) + "\n";
  }
};

/// CLI11 accepts "nan" as a number in any range. @throws CLI::ValidationError
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

void add_version(CLI::App* app) {
  app->set_version_flag("--version", "rcs " RCS_VERSION);
  for (CLI::App* below : app->get_subcommands([](CLI::App*) { return true; })) add_version(below);
}

/// The first word that no command knows, with a suggestion; empty when there is none.
std::string unknown_word(const CLI::App& app, int argc, char** argv) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;  // what follows is positional
    std::vector<std::string> known;
    if (word.size() > 1 && word[0] == '-') {
      const std::string name = word.substr(0, word.find('='));
      for (const CLI::Option* option : command->get_options()) {
        for (const std::string& l : option->get_lnames()) known.push_back("--" + l);
        for (const std::string& s : option->get_snames()) known.push_back("-" + s);
      }
      const bool number = std::isdigit(static_cast<unsigned char>(word[1])) != 0 || word[1] == '.';
      if (!number && std::find(known.begin(), known.end(), name) == known.end()) {
        const bool version = name == "-v" || name == "-V";
        return fmt::format("unknown option {}{}", name,
                           version ? "; did you mean --version?" : suggestion(name, known));
      }
      continue;
    }
    const std::vector<const CLI::App*> below =
        command->get_subcommands([](const CLI::App*) { return true; });
    if (below.empty()) continue;  // a positional
    for (const CLI::App* sub : below) known.push_back(sub->get_name());
    const auto at = std::find(known.begin(), known.end(), word);
    if (at == known.end()) {
      return fmt::format("unknown command {}{}", word, suggestion(word, known));
    }
    command = below[static_cast<std::size_t>(at - known.begin())];
  }
  return "";
}

/// What is wrong with a command line of known words.
std::string usage_text(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  const std::vector<const CLI::App*> below =
      command->get_subcommands([](const CLI::App*) { return true; });
  const bool required = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  if (below.empty() || !required) return error.what();
  std::string names;
  for (const CLI::App* sub : below) names += (names.empty() ? "" : ", ") + sub->get_name();
  return "a command is required: " + names;
}

int rcs_main(int argc, char** argv) {
  CLI::App app("Operation, logs, maps, simulation and evaluation of the navigation system.", "rcs");
  app.formatter(std::make_shared<HelpFormat>());  // commands inherit it
  app.require_subcommand(1);
  app.footer(
      std::string(kExitStatusHelp) +
      "\n"
      "Results go to stdout (--json: as JSON, see docs/user/json.md), messages to stderr.\n"
      "`rcs COMMAND --help` has examples.\n"
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
  add_version(&app);
  note_command_line(argc, argv);
  try {
    app.parse(argc, argv);
    check_numbers(app);
  } catch (const CLI::ParseError& e) {
    const std::string unknown = unknown_word(app, argc, argv);
    const bool help = e.get_exit_code() == 0;
    if (!unknown.empty() && (!help || unknown.rfind("unknown command", 0) == 0)) {
      const std::string words = words_of(app);
      const std::string command = words.empty() ? "rcs" : "rcs " + words;
      fmt::print(stderr, "{}: {} (see `{} --help`)\n", command, unknown, command);
      return kExitUsage;
    }
    if (names_missing_input(e)) return fail(words_of(app), Error{missing_text(e)});
    if (e.get_exit_code() == 0) return app.exit(e) == 0 ? kExitOk : kExitUsage;
    const std::string words = words_of(app);
    const std::string command = words.empty() ? "rcs" : "rcs " + words;
    fmt::print(stderr, "{}: {}; see `{} --help`\n", command, usage_text(app, e), command);
    return kExitUsage;
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
