#pragma once
// Parses the command line of a program. All programs have the same help, version and errors.

#include <functional>
#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace rcs::command_line {

/// How a program ends that has nothing to do: after its help, its version, or an error.
struct Ending {
  int status = 0;    ///< kExitOk: the text is for stdout; else for stderr
  std::string text;  ///< ends with a line break
};

/// For a folder that is given where a file is needed: what to do instead; empty: nothing is known.
using FolderAdvice = std::function<std::string(const std::string& folder)>;

/// Adds --version and the form of the help to the program and all its commands, and parses the
/// command line into the variables of its options.
/// @param app  has the name of the program and all options and commands
/// @return an ending if the program has nothing else to do. kExitUsage: the command line is
/// invalid,
///         and the text names the word and, if there is one, a similar valid one; kExitInput: it
///         names a file or a folder that does not exist
[[nodiscard]] std::optional<Ending> parse(CLI::App* app, int argc, const char* const* argv,
                                          const FolderAdvice& advice = {});

/// Prints the text to stdout or stderr. @return the status
int print(const Ending& ending);

/// Full name of the command that was chosen: "rcs log cut".
[[nodiscard]] std::string chosen_name(const CLI::App& app);

}  // namespace rcs::command_line
