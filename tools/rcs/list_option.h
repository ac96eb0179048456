#pragma once
// Options with several values have one syntax: a list of numbers or names is one word, separated by
// commas; an option whose value is a file, an identity, a position or KEY=VALUE is repeated.
// Values are never separate words: a positional argument may follow.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace rcs::cli {

/// --name A,B,C
template <class T>
CLI::Option* add_list(CLI::App* app, const std::string& name, std::vector<T>* values,
                      const std::string& text) {
  return app->add_option(name, *values, text + "; a list A,B,...")
      ->delimiter(',')
      ->allow_extra_args(false);
}

/// --name A --name B
inline CLI::Option* add_repeated(CLI::App* app, const std::string& name,
                                 std::vector<std::string>* values, const std::string& text) {
  return app->add_option(name, *values, text + "; may be repeated")->allow_extra_args(false);
}

/// --name 1,2 with a fixed number of numbers in [low, high].
/// @param form  the names of the numbers, separated by commas: "FROM,TO"
CLI::Option* add_numbers(CLI::App* app, const std::string& name, std::vector<double>* values,
                         const std::string& form, double low, double high, const std::string& text);

}  // namespace rcs::cli
