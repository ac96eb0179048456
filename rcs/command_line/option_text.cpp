#include "rcs/command_line/option_text.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string_view>

namespace rcs::command_line {
namespace {

std::vector<std::string> parts_of(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
    text.replace(at, from.size(), to);
    at += to.size();
  }
  return text;
}

/// "a, b or c".
std::string enumerated(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool last = i + 1 == words.size();
    text += (i == 0 ? "" : last ? " or " : ", ") + words[i];
  }
  return text;
}

/// What a validator of CLI11 permits: "FLOAT in [0 - 1e+06]", "{plane,paper}", "FILE".
void set_permitted(const std::string& validator, OptionText* out) {
  const std::size_t bracket = validator.find(" in [");
  if (validator.front() == '{') {
    out->choices = parts_of(std::string_view(validator).substr(1, validator.size() - 2), ',');
    out->value = "NAME";
  } else if (bracket != std::string::npos) {
    const std::string limits = validator.substr(bracket + 5, validator.size() - bracket - 6);
    out->range = replaced(replaced(limits, " - ", " to "), "e+0", "e");
    out->range = replaced(replaced(out->range, "e+", "e"), "e-0", "e-");
  } else if (validator == "NONNEGATIVE") {
    out->range = "at least 0";
  } else if (validator == "POSITIVE") {
    out->range = "more than 0";
  } else if (validator == "DIR") {
    out->value = "FOLDER";
  } else if (validator == "FILE") {
    out->value = "FILE";
  }
}

/// CLI11 names a value by its type and its validators: "FLOAT:FLOAT in [0 - 10]".
void set_value(const CLI::Option& option, OptionText* out) {
  const std::vector<std::string> parts = parts_of(option.get_type_name(), ':');
  const std::string& type = parts.front();
  if (type == "UINT") out->range = "at least 0";
  for (std::size_t i = 1; i < parts.size(); ++i) set_permitted(parts[i], out);
  const bool standard_type = type == "TEXT" || type == "FLOAT" || type == "INT" || type == "UINT";
  if (!standard_type) {
    out->value = type;
  } else if (out->value.empty()) {
    out->value = type == "TEXT" ? "TEXT" : type == "FLOAT" ? "NUMBER" : "INTEGER";
  }
}

/// "[a,b]", a list, as it is written on the command line, or as the values of a repeated option.
std::string standard_of(const CLI::Option& option) {
  std::string text = option.get_default_str();
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return text;
  const std::string list = text.substr(1, text.size() - 2);
  return option.get_delimiter() == ',' ? list : replaced(list, ",", ", ");
}

/// In alphabetical order, because the set has the order of the addresses.
std::vector<std::string> names_of(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  names.reserve(options.size());
  for (const CLI::Option* o : options) names.push_back(o->get_name(o->get_positional()));
  std::sort(names.begin(), names.end());
  return names;
}

bool states_default(const OptionText& option) {
  std::string lower = option.meaning;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower.find("default") != std::string::npos;
}

/// True if the word is in the text, and not a part of another word.
bool has_word(const std::string& text, const std::string& word) {
  const auto in_word = [&](std::size_t at) {
    return at < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_');
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if ((at == 0 || !in_word(at - 1)) && !in_word(at + word.size())) return true;
  }
  return false;
}

bool states_choices(const OptionText& option) {
  return !option.choices.empty() &&
         std::all_of(option.choices.begin(), option.choices.end(),
                     [&](const std::string& choice) { return has_word(option.meaning, choice); });
}

/// " -o FILE" of an option that must be given.
std::string required_text(const CLI::Option& option) {
  const bool has_short = !option.get_snames().empty();
  return fmt::format(" {} {}", has_short ? "-" + option.get_snames().front() : option.get_name(),
                     option_text(option).value);
}

}  // namespace

std::string one_line(const std::string& lines) {
  std::string out;
  for (const std::string& line : parts_of(lines, '\n')) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    const std::size_t end = line.find_last_not_of(' ');
    out += (out.empty() ? "" : " ") + line.substr(begin, end - begin + 1);
  }
  return out;
}

OptionText option_text(const CLI::Option& option) {
  OptionText out;
  out.positional = option.get_positional();
  const bool several = option.get_items_expected_max() > 1;
  out.names = out.positional ? option.get_name(true) + (several ? "..." : "")
                             : replaced(option.get_name(false, true), ",", ", ");
  if (option.get_type_size() != 0) set_value(option, &out);
  if (option.get_items_expected_max() > 0) out.standard = standard_of(option);
  out.required = option.get_required();
  out.meaning = one_line(option.get_description());
  out.needs = names_of(option.get_needs());
  out.excludes = names_of(option.get_excludes());
  return out;
}

std::string permitted(const OptionText& option) {
  return option.choices.empty() ? option.range : enumerated(option.choices);
}

std::string explained(const OptionText& option, char joint) {
  std::vector<std::string> facts;
  if (!permitted(option).empty() && !states_choices(option)) facts.push_back(permitted(option));
  if (option.required && !option.positional) facts.emplace_back("required");
  if (!option.standard.empty() && !states_default(option)) {
    facts.push_back("default: " + option.standard);
  }
  if (!option.needs.empty()) {
    facts.push_back(fmt::format("requires {}", fmt::join(option.needs, " and ")));
  }
  if (!option.excludes.empty()) facts.push_back("not with " + enumerated(option.excludes));
  if (facts.empty()) return option.meaning;
  constexpr std::size_t kShort = 32;
  for (std::string& fact : facts) {
    if (fact.size() <= kShort) std::replace(fact.begin(), fact.end(), ' ', joint);
  }
  return fmt::format("{} ({})", option.meaning, fmt::join(facts, "; "));
}

std::string synopsis_of(const CLI::App& app, const std::string& name) {
  if (!app.get_subcommands([](const CLI::App*) { return true; }).empty()) return name + " COMMAND";
  std::string arguments;
  std::string required;
  bool others = false;
  for (const CLI::Option* o : app.get_options()) {
    if (o->get_positional()) {
      const std::string word = option_text(*o).names;
      arguments += o->get_required() ? " " + word : " [" + word + "]";
    } else if (o->get_required()) {
      required += required_text(*o);
    } else {
      others = others || !(o->check_lname("help") || o->check_lname("version"));
    }
  }
  return name + arguments + required + (others ? " [OPTIONS]" : "");
}

}  // namespace rcs::command_line
