#pragma once
// The command line of a program as text, from its CLI11 tree: the source of the reference pages,
// the man pages and the completion.

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace rcs::cli {

struct OptionText {
  std::string names;                 ///< "-o, --out", or "LOG" of a positional
  std::string value;                 ///< "number, 0 to 10"; empty: a flag
  std::vector<std::string> choices;  ///< all permitted values; empty: not enumerated
  std::string standard;              ///< default value; empty: none
  std::string meaning;
  bool required = false;
};

/// Part of the text below the options.
struct TextBlock {
  std::string text;
  bool verbatim = false;  ///< lines are kept: an example or a table
};

struct ProgramText {
  std::string name;  ///< "rcs log cut"
  std::string about;
  std::string synopsis;
  std::vector<OptionText> positionals;
  std::vector<OptionText> options;  ///< without --help and --version
  std::vector<TextBlock> description;
  std::vector<TextBlock> examples;
  std::vector<ProgramText> commands;
};

/// The program with all its commands.
[[nodiscard]] ProgramText text_of(const CLI::App& program);

/// "0 success", "1 failure": from the text "Exit status: 0 success; 1 failure." below the options.
[[nodiscard]] std::vector<std::string> exit_status(const ProgramText& program);

/// Programs that are not commands of rcs: the nodes, which share one command line, and sim.
[[nodiscard]] std::vector<ProgramText> other_programs();

/// "rcs log cut" as the name of a man page or an anchor: "rcs-log-cut".
[[nodiscard]] std::string hyphenated(std::string name);

/// @param lines  a text with line breaks; joined by blanks
[[nodiscard]] std::string one_line(std::string_view lines);

}  // namespace rcs::cli
