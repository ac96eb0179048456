#include "rcs/command_line/usage_error.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "rcs/base/text.h"
#include "rcs/command_line/option_text.h"

namespace rcs::command_line {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& l : option->get_lnames()) names.push_back("--" + l);
    for (const std::string& s : option->get_snames()) names.push_back("-" + s);
  }
  return names;
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// An option, not a number or the name of a stream.
bool is_option(const std::string& word) {
  if (word.size() < 2 || word[0] != '-') return false;
  return std::isdigit(static_cast<unsigned char>(word[1])) == 0 && word[1] != '.';
}

/// The long option that is similar to "-chek" or "--chek". Dashes do not count: with them, short
/// words are similar.
std::string similar_option(const CLI::App& command, const std::string& name) {
  if (name == "-v" || name == "-V") return "version";
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options()) {
    known.insert(known.end(), option->get_lnames().begin(), option->get_lnames().end());
  }
  return most_similar(name.substr(std::min(name.find_first_not_of('-'), name.size())), known);
}

/// @return empty if the command has the option
std::string unknown_option(const CLI::App& command, const std::string& word) {
  const std::vector<std::string> known = option_names(command);
  const std::string name = word.substr(0, word.find('='));
  // "-oFILE" is -o with its value.
  if (contains(known, name) || (word[1] != '-' && contains(known, word.substr(0, 2)))) return "";
  const std::string similar = similar_option(command, name);
  return fmt::format("unknown option {}{}", name,
                     similar.empty() ? "" : fmt::format("; did you mean --{}?", similar));
}

/// The texts at the stars of a pattern: "Value * not in *". The pattern matches a whole text.
std::optional<std::vector<std::string>> match(std::string_view text, std::string_view pattern) {
  std::vector<std::string> found;
  while (true) {
    const std::size_t star = std::min(pattern.find('*'), pattern.size());
    if (text.substr(0, star) != pattern.substr(0, star)) return std::nullopt;
    text.remove_prefix(star);
    if (star == pattern.size()) return text.empty() ? std::optional(found) : std::nullopt;
    pattern.remove_prefix(star + 1);
    const std::string_view next = pattern.substr(0, pattern.find('*'));
    const std::size_t end = next.empty() ? text.size() : text.find(next);
    if (end == std::string_view::npos) return std::nullopt;
    found.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
  }
}

/// The permitted values of an option by its name in a message of CLI11; empty: unknown.
std::string expected_value(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_name() == name) return permitted(option_text(*option));
  }
  return "";
}

/// "a number, 0 to 100".
std::string expected_type(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_name() != name) continue;
    const OptionText text = option_text(*option);
    const std::string type = text.value == "INTEGER"  ? "an integer"
                             : text.value == "NUMBER" ? "a number"
                                                      : text.value;
    return text.range.empty() ? type : type + ", " + text.range;
  }
  return "another value";
}

/// A value that a validator of CLI11 rejects: out of range, or none of the choices.
std::string rejected_value(const CLI::App& command, const std::string& message) {
  constexpr std::array<std::string_view, 4> kForms = {
      "*: Value * not in range *", "*: Number less or equal to 0: (*)",
      "*: Number less than 0: (*)", "*: * not in {*}"};
  for (const std::string_view form : kForms) {
    const auto found = match(message, form);
    if (!found) continue;
    const std::string expected = expected_value(command, (*found)[0]);
    if (expected.empty()) continue;
    return fmt::format("{}: expected {}, not {}", (*found)[0], expected, (*found)[1]);
  }
  return message;
}

/// Such as --record [FOLDER].
bool is_optional(const CLI::Option& option) { return option.get_items_expected_min() == 0; }

std::string required_value(const CLI::App& command, const std::string& name) {
  return fmt::format("{}: a value is required ({})", name, expected_type(command, name));
}

/// Null: the command has no option of this name, or it is a flag.
const CLI::Option* option_with_value(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    const bool named =
        (name.rfind("--", 0) == 0 && contains(option->get_lnames(), name.substr(2))) ||
        (name.size() == 2 && contains(option->get_snames(), name.substr(1)));
    if (named) return option->get_items_expected_min() > 0 ? option : nullptr;
  }
  return nullptr;
}

void check_finite(const CLI::Option& option, const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (end != text.c_str() && *end == '\0' && !std::isfinite(number)) {
    throw CLI::ValidationError(option.get_name(), text + " is not a finite number");
  }
}

template <typename Integer>
std::errc parsed_as(std::string_view text) {
  Integer number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end != text.data() + text.size() ? std::errc::invalid_argument
                                                                  : error;
}

/// CLI11 reads a leading zero as the sign of an octal number, and limits or wraps a number out of
/// the range of its type.
void check_integer(const CLI::App& command, const CLI::Option& option, const std::string& text) {
  const bool is_unsigned = option.get_type_name().rfind("UINT", 0) == 0;
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  const std::size_t first = digits.find_first_not_of('-');
  const bool octal =
      first != std::string_view::npos && digits[first] == '0' && first + 1 < digits.size();
  const std::errc error = octal         ? std::errc::invalid_argument
                          : is_unsigned ? parsed_as<std::uint64_t>(digits)
                                        : parsed_as<std::int64_t>(digits);
  if (error == std::errc()) return;
  const bool too_large = error == std::errc::result_out_of_range;
  throw CLI::ValidationError(
      option.get_name(), too_large
                             ? text + " is not in the range of an integer of 64 bits"
                             : fmt::format("expected {}, in decimal without leading zeros, not {}",
                                           expected_type(command, option.get_name()), text));
}

std::string missing_command(const CLI::App& command) {
  std::string names;
  for (const CLI::App* below : commands_of(command)) {
    names += (names.empty() ? "" : ", ") + below->get_name();
  }
  return "a command is required: " + names;
}

}  // namespace

const CLI::App& chosen_command(const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  return chosen.empty() ? app : chosen_command(*chosen.front());
}

std::string unknown_word(const CLI::App& app, int argc, const char* const* argv) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;  // what follows is positional
    if (is_option(word)) {
      std::string unknown = unknown_option(*command, word);
      if (!unknown.empty()) return unknown;
      continue;
    }
    const std::vector<const CLI::App*> below = commands_of(*command);
    if (below.empty()) continue;  // a positional
    const auto at = std::find_if(below.begin(), below.end(),
                                 [&](const CLI::App* known) { return known->get_name() == word; });
    if (at == below.end()) {
      std::vector<std::string> known;
      known.reserve(below.size());
      for (const CLI::App* one : below) known.push_back(one->get_name());
      return fmt::format("unknown command {}{}", word, suggestion(word, known));
    }
    command = *at;
  }
  return "";
}

std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = chosen_command(app);
  const std::string message = error.what();
  const auto status = static_cast<CLI::ExitCodes>(error.get_exit_code());
  if (status == CLI::ExitCodes::RequiredError && !commands_of(command).empty()) {
    return missing_command(command);
  }
  if (const auto found = match(message, "Could not convert: * = *")) {
    const std::string& name = (*found)[0];
    return fmt::format("{}: expected {}, not {}", name, expected_type(command, name), (*found)[1]);
  }
  if (const auto found = match(message, "*: * required * missing")) {
    return required_value(command, (*found)[0]);
  }
  if (const auto found = match(message, "*: At least * required but received *")) {
    return fmt::format("{}: at least {} are required", (*found)[0], (*found)[1]);
  }
  if (const auto found = match(message, "* excludes *")) {
    return fmt::format("{} and {} exclude each other", (*found)[0], (*found)[1]);
  }
  if (const auto found = match(message, "The following argument* not expected: *")) {
    return "unexpected argument " + (*found)[1];
  }
  return status == CLI::ExitCodes::ValidationError ? rejected_value(command, message) : message;
}

std::string missing_value(const CLI::App& app, int argc, const char* const* argv) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;  // what follows is positional
    if (!is_option(word)) {
      for (const CLI::App* below : commands_of(*command)) {
        if (below->get_name() == word) command = below;
      }
      continue;
    }
    const std::size_t equals = word.find('=');
    const CLI::Option* option = option_with_value(*command, word.substr(0, equals));
    if (option == nullptr) continue;  // a flag, unknown, or "-oFILE"
    const bool alone = equals == std::string::npos && (i + 1 == argc || is_option(argv[i + 1]));
    if (alone && is_optional(*option)) continue;
    if (equals == std::string::npos && i + 1 == argc) break;  // CLI11 reports it
    const std::string value = equals == std::string::npos ? argv[++i] : word.substr(equals + 1);
    if (value.empty() || (equals == std::string::npos && is_option(value))) {
      return required_value(*command, option->get_name());
    }
  }
  return "";
}

void check_values(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string value = option_text(*option).value;
    if (value.empty()) continue;  // a flag
    const bool tuple = value.find(',') != std::string::npos;
    for (const std::string& text : option->results()) {
      if (text.empty() && is_optional(*option)) continue;
      if (text.empty()) throw CLI::ValidationError(required_value(app, option->get_name()));
      if (value == "NUMBER" || value == "INTEGER" || tuple) check_finite(*option, text);
      if (value == "INTEGER") check_integer(app, *option, text);
    }
  }
  for (const CLI::App* chosen : app.get_subcommands()) check_values(*chosen);
}

}  // namespace rcs::command_line
