#pragma once
// The command line of a program as text, from its CLI11 tree: the source of the help, the reference
// pages, the man pages and the completion.

#include <string>
#include <vector>

#include "rcs/command_line/option_text.h"

namespace rcs::command_line {

/// Part of the text below the options.
struct TextBlock {
  std::string text;
  bool verbatim = false;  ///< lines are kept: an example or a table
};

struct ProgramText {
  std::string name;   ///< "rcs log cut"
  std::string about;  ///< without the last full stop
  std::string synopsis;
  std::vector<OptionText> arguments;
  std::vector<OptionText> options;  ///< without --help and --version
  std::string footer;               ///< the text below the options; the blocks divide it
  std::vector<TextBlock> description;
  std::vector<TextBlock> examples;
  std::vector<ProgramText> commands;
};

/// The program or command with all its commands.
/// @param name  full name of the program or command
[[nodiscard]] ProgramText program_text(const CLI::App& app, const std::string& name);

/// The text of --help, at most kTextColumns wide.
[[nodiscard]] std::string help_text(const ProgramText& program);

}  // namespace rcs::command_line
