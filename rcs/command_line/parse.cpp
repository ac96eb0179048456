#include "rcs/command_line/parse.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "rcs/base/exit_status.h"
#include "rcs/command_line/program_text.h"
#include "rcs/command_line/usage_error.h"

namespace rcs::command_line {
namespace {

class HelpFormat final : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode /*mode*/) const override {
    return help_text(program_text(*app, name));
  }
};

/// "rcs 0.1.0", "wm (rcs) 0.1.0".
std::string version_text(const std::string& program) {
  const std::string name = program.substr(0, program.find(' '));
  return name + (name == "rcs" ? "" : " (rcs)") + " " RCS_VERSION;
}

void complete(CLI::App* app, const std::string& version, const std::shared_ptr<HelpFormat>& help) {
  app->set_version_flag("--version", version);
  app->formatter(help);
  for (CLI::App* command : app->get_subcommands([](CLI::App*) { return true; })) {
    complete(command, version, help);
  }
}

/// A file or a folder of the command line does not exist: an input, although CLI11 checks it.
bool names_missing_input(const CLI::ParseError& error) {
  if (error.get_exit_code() != static_cast<int>(CLI::ExitCodes::ValidationError)) return false;
  const std::string_view text = error.what();
  return text.find(" does not exist: ") != std::string_view::npos ||
         text.find(" is actually a ") != std::string_view::npos;
}

/// "RUN: File does not exist: a.log" as the commands report it: "a.log: file does not exist".
std::string missing_text(const CLI::ParseError& error, const FolderAdvice& advice) {
  std::string text = error.what();
  const std::size_t path = text.rfind(": ");
  const std::size_t problem = text.rfind(": ", path - 1);
  if (path == std::string::npos || problem == std::string::npos) return text;
  std::string reason = text.substr(problem + 2, path - problem - 2);
  reason[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(reason[0])));
  const std::string file = text.substr(path + 2);
  std::error_code problem_of_file;
  // CLI11 reports every error of the system as a missing file, e.g. that of a closed folder.
  if (std::filesystem::status(file, problem_of_file).type() == std::filesystem::file_type::none) {
    reason = problem_of_file.message();
  }
  const bool folder = reason == "file is actually a directory";
  const std::string instead = folder && advice ? advice(file) : "";
  return file + ": " + (instead.empty() ? reason : instead);
}

/// The text of --help or --version.
std::string requested_text(const CLI::App& app, const CLI::ParseError& request) {
  std::ostringstream out;
  (void)app.exit(request, out, out);
  return out.str();
}

}  // namespace

std::string chosen_name(const CLI::App& app) {
  std::string name = app.get_name();
  for (const CLI::App* command = &app; !command->get_subcommands().empty();) {
    command = command->get_subcommands().front();
    name += " " + command->get_name();
  }
  return name;
}

std::optional<Ending> parse(CLI::App* app, int argc, const char* const* argv,
                            const FolderAdvice& advice) {
  complete(app, version_text(app->get_name()), std::make_shared<HelpFormat>());
  const auto wrong_usage = [app](const std::string& error) {
    const std::string name = chosen_name(*app);
    return Ending{kExitUsage, fmt::format("{}: {}; see `{} --help`\n", name, error, name)};
  };
  const std::string missing = missing_value(*app, argc, argv);
  try {
    app->parse(argc, argv);
    if (!missing.empty()) return wrong_usage(missing);
    check_values(*app);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    const bool requested = e.get_exit_code() == 0;
    const std::string name = chosen_name(*app);
    const std::string unknown = unknown_word(*app, argc, argv);
    // Help of an unknown command would be that of its parent.
    if (!unknown.empty() && (!requested || unknown.rfind("unknown command", 0) == 0)) {
      return Ending{kExitUsage, fmt::format("{}: {} (see `{} --help`)\n", name, unknown, name)};
    }
    if (requested) return Ending{kExitOk, requested_text(*app, e)};
    if (!missing.empty()) return wrong_usage(missing);
    if (names_missing_input(e)) {
      return Ending{kExitInput, fmt::format("{}: {}\n", name, missing_text(e, advice))};
    }
    return wrong_usage(usage_error(*app, e));
  }
}

int print(const Ending& ending) {
  fmt::print(ending.status == kExitOk ? stdout : stderr, "{}", ending.text);
  return ending.status;
}

}  // namespace rcs::command_line
