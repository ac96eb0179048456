#include "rcs/command_line/program_text.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

#include "rcs/base/text.h"

namespace rcs::command_line {
namespace {

/// A line with blanks at its begin or columns is verbatim; others are prose.
void add_line(const std::string& line, std::vector<TextBlock>* blocks) {
  const bool verbatim = line.find("  ") != std::string::npos;
  if (blocks->empty() || blocks->back().verbatim != verbatim) {
    blocks->push_back({line, verbatim});
  } else {
    blocks->back().text += "\n" + line;
  }
}

/// Divides the text below the options into its description and, from "Example" on, its examples.
void add_footer(const std::string& footer, ProgramText* out) {
  out->footer = footer;
  std::istringstream in(footer);
  std::vector<TextBlock>* blocks = &out->description;
  for (std::string line; std::getline(in, line);) {
    if (line.compare(0, 7, "Example") == 0 && line.find(':') < 9) {
      blocks = &out->examples;
      const std::size_t text = line.find_first_not_of(' ', line.find(':') + 1);
      if (text != std::string::npos) add_line("  " + line.substr(text), blocks);
    } else if (!line.empty()) {
      add_line(line, blocks);
    }
  }
}

/// A blank at which no line is broken.
constexpr char kJoint = '\x1f';

/// A line of the help: what is given on the left, its explanation on the right or below.
std::string entry(const std::string& name, const std::string& text) {
  constexpr std::size_t kIndent = 28;
  std::string head = fmt::format("  {:<{}}", name, kIndent - 2);
  if (head.back() != ' ') head += "\n" + std::string(kIndent, ' ');
  // The head has the place of the dots.
  const std::string dots(kIndent, '.');
  std::string lines = wrapped(dots + text, kIndent).substr(kIndent);
  std::replace(lines.begin(), lines.end(), kJoint, ' ');
  return head + lines + "\n";
}

std::string entry(const OptionText& option) {
  const bool named = option.positional || option.value.empty();
  return entry(named ? option.names : option.names + " " + option.value, explained(option, kJoint));
}

std::string section(const char* heading, const std::string& entries) {
  return entries.empty() ? "" : fmt::format("\n{}:\n{}", heading, entries);
}

}  // namespace

ProgramText program_text(const CLI::App& app, const std::string& name) {
  ProgramText out;
  out.name = name;
  out.about = one_line(app.get_description());
  if (!out.about.empty() && out.about.back() == '.') out.about.pop_back();
  out.synopsis = synopsis_of(app, name);
  for (const CLI::Option* option : app.get_options()) {
    if (option->check_lname("help") || option->check_lname("version")) continue;
    (option->get_positional() ? out.arguments : out.options).push_back(option_text(*option));
  }
  // A command has the footer of its parent until it sets its own.
  const bool inherited =
      app.get_parent() != nullptr && app.get_parent()->get_footer() == app.get_footer();
  if (!inherited) add_footer(app.get_footer(), &out);
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    out.commands.push_back(program_text(*command, name + " " + command->get_name()));
  }
  return out;
}

std::string help_text(const ProgramText& program) {
  std::string arguments;
  std::string options;
  std::string commands;
  for (const OptionText& argument : program.arguments) arguments += entry(argument);
  for (const OptionText& option : program.options) options += entry(option);
  options += entry("-h, --help", "print this help and exit");
  options += entry("--version", "print the version and exit");
  for (const ProgramText& command : program.commands) {
    commands += entry(command.name.substr(program.name.size() + 1), command.about);
  }
  std::string text =
      wrapped(program.about + ".", 0) + "\n\n" + wrapped("Usage: " + program.synopsis, 7) + "\n" +
      section("Arguments", arguments) + section("Commands", commands) + section("Options", options);
  if (!commands.empty()) {
    text +=
        fmt::format("\n`{} COMMAND --help` describes a command and has examples.\n", program.name);
  }
  if (!program.footer.empty()) text += "\n" + program.footer + "\n";
  return text;
}

}  // namespace rcs::command_line
