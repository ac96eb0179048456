#pragma once
// What is wrong with a command line, in the words of this project instead of those of CLI11.

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace rcs::command_line {

/// The first word that no command knows, with a suggestion: "unknown option --jsn; did you mean
/// --json?". Empty when there is none.
[[nodiscard]] std::string unknown_word(const CLI::App& app, int argc, const char* const* argv);

/// What is wrong with a command line of known words: "--radius: expected 0 to 100, not 200".
[[nodiscard]] std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

/// The first option whose value is empty, or is an option: CLI11 accepts the next word as the
/// value, whatever it is, and an empty value would mean that the option was not given. "--opt=-x"
/// is a value. Empty when there is none.
[[nodiscard]] std::string missing_value(const CLI::App& app, int argc, const char* const* argv);

/// Rejects what CLI11 accepts: empty values, "nan" and "inf" as numbers of any range, integers that
/// are not decimal or do not fit. @throws CLI::ValidationError
void check_values(const CLI::App& app);

/// The command that was chosen on the command line; without commands the program itself.
[[nodiscard]] const CLI::App& chosen_command(const CLI::App& app);

}  // namespace rcs::command_line
