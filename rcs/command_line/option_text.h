#pragma once
// An option or an argument as the help, the reference pages and the completion present it.

#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace rcs::command_line {

struct OptionText {
  std::string names;                 ///< "-o, --out"; of an argument "LOG", or "LOG..." for several
  std::string value;                 ///< name of the value: "NUMBER"; empty: a flag
  std::string range;                 ///< "0 to 10", "at least 0"; empty: any
  std::vector<std::string> choices;  ///< all permitted values; empty: not enumerated
  std::string standard;              ///< default value; empty: none
  std::string meaning;               ///< one line
  std::vector<std::string> needs;    ///< options that must be given, too
  std::vector<std::string> excludes;
  bool positional = false;
  bool required = false;
};

[[nodiscard]] OptionText option_text(const CLI::Option& option);

/// "0 to 10", or "plane, paper or gicp"; empty: any value.
[[nodiscard]] std::string permitted(const OptionText& option);

/// The meaning, and in parentheses what it does not state itself: permitted values, default value,
/// related options. "largest error [m] (0 to 100; default: 10; requires --global)"
/// @param joint  the blank within a short part in parentheses, where a line should not be broken
[[nodiscard]] std::string explained(const OptionText& option, char joint = ' ');

/// "rcs log cut LOG -o FILE [OPTIONS]".
/// @param name  of the program or command
[[nodiscard]] std::string synopsis_of(const CLI::App& app, const std::string& name);

/// Lines joined by blanks.
[[nodiscard]] std::string one_line(const std::string& lines);

}  // namespace rcs::command_line
