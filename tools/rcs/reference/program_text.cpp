#include "tools/rcs/reference/program_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <regex>
#include <set>
#include <sstream>
#include <utility>

#include "rcs/node/process/node_options.h"
#include "sim/sim_options.h"

namespace rcs::cli {
namespace {

/// "{a,b}" gives a and b.
std::vector<std::string> choices_of(const std::string& set) {
  std::vector<std::string> choices;
  std::istringstream in(set.substr(1, set.find('}') - 1));
  for (std::string one; std::getline(in, one, ',');) choices.push_back(one);
  return choices;
}

/// CLI11 names a value by its type and its validators: "FLOAT:FLOAT in [0 - 10]".
void set_value(const CLI::Option& option, OptionText* out) {
  const std::string name = option.get_type_name();
  const std::size_t colon = name.find(':');
  std::string value = colon == std::string::npos ? name : name.substr(colon + 1);
  if (!value.empty() && value.front() == '{') {
    out->choices = choices_of(value);
    value = fmt::format("{}", fmt::join(out->choices, ", "));
  }
  constexpr std::array<std::pair<const char*, const char*>, 10> kWords = {
      {{"(FLOAT|INT|UINT) in \\[(.*) - (.*)\\]", "$1, $2 to $3"},
       {"\\bNONNEGATIVE\\b", "number, at least 0"},
       {"\\bPOSITIVE\\b", "number, more than 0"},
       {"\\bTEXT\\b", "text"},
       {"\\bFLOAT\\b", "number"},
       {"\\bU?INT\\b", "integer"},
       {"\\bFILE\\b", "file"},
       {"\\bDIR\\b", "folder"},
       {"\\bPATH\\(existing\\)", "file or folder"},
       {"e\\+0?", "e"}}};
  for (const auto& [from, to] : kWords) value = std::regex_replace(value, std::regex(from), to);
  const int least = option.get_items_expected_min();
  const int most = option.get_items_expected_max();
  if (most > std::max(1, least)) {
    value += least > 1 ? fmt::format("; {} or more", least) : "; several";
  } else if (least > 1) {
    value += fmt::format("; {} values", least);
  }
  out->value = value;
}

/// In alphabetical order, because the set has the order of the addresses.
std::string names_of(const char* what, const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* o : options) names.push_back(o->get_name(o->get_positional()));
  std::sort(names.begin(), names.end());
  return names.empty() ? "" : fmt::format("{}{}", what, fmt::join(names, ", "));
}

OptionText option_text(const CLI::Option& option) {
  OptionText out;
  const bool positional = option.get_positional();
  out.names = positional ? option.get_name(true)
                         : std::regex_replace(option.get_name(false, true), std::regex(","), ", ");
  if (option.get_type_size() != 0) set_value(option, &out);
  if (option.get_items_expected_max() > 0) out.standard = option.get_default_str();
  out.required = option.get_required();
  out.meaning = one_line(option.get_description());
  out.meaning += names_of("; requires ", option.get_needs());
  out.meaning += names_of("; excludes ", option.get_excludes());
  return out;
}

std::string synopsis_of(const CLI::App& app, const std::string& name, bool has_commands) {
  std::string text = name;
  if (has_commands) return text + " COMMAND";
  std::string required;
  bool others = false;
  for (const CLI::Option* o : app.get_options()) {
    if (o->get_positional()) {
      const bool several = o->get_items_expected_max() > 1;
      const std::string word = o->get_name(true) + (several ? "..." : "");
      text += o->get_required() ? " " + word : " [" + word + "]";
    } else if (o->get_required()) {
      required += o->check_lname("out") ? " -o OUT" : " " + o->get_name() + " VALUE";
    } else {
      others = others || !(o->check_lname("help") || o->check_lname("version"));
    }
  }
  return text + required + (others ? " [OPTIONS]" : "");
}

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

/// @param inherited  the text below the options of the parent, which CLI11 copies
ProgramText command_text(const CLI::App& app, const std::string& name,
                         const std::string& inherited) {
  ProgramText out;
  out.name = name;
  out.about = one_line(app.get_description());
  if (!out.about.empty() && out.about.back() == '.') out.about.pop_back();
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  out.synopsis = synopsis_of(app, name, !commands.empty());
  for (const CLI::Option* option : app.get_options()) {
    if (option->check_lname("help") || option->check_lname("version")) continue;
    (option->get_positional() ? out.positionals : out.options).push_back(option_text(*option));
  }
  if (app.get_footer() != inherited) add_footer(app.get_footer(), &out);
  for (const CLI::App* command : commands) {
    out.commands.push_back(
        command_text(*command, name + " " + command->get_name(), app.get_footer()));
  }
  return out;
}

}  // namespace

ProgramText text_of(const CLI::App& program) {
  return command_text(program, program.get_name(), "");
}

std::vector<std::string> exit_status(const ProgramText& program) {
  constexpr std::string_view kBegin = "Exit status: ";
  std::vector<std::string> all;
  for (const TextBlock& block : program.description) {
    const std::size_t begin = block.text.find(kBegin);
    if (begin == std::string::npos) continue;
    const std::size_t end = block.text.find(".\n", begin);
    std::istringstream in(block.text.substr(begin + kBegin.size(), end - begin - kBegin.size()));
    for (std::string one; std::getline(in >> std::ws, one, ';');) all.push_back(one_line(one));
  }
  return all;
}

std::vector<ProgramText> other_programs() {
  std::vector<ProgramText> all;
  for (const char* name : {"sp", "wm", "bg", "gateway", "ros2_bridge"}) {
    CLI::App app;
    NodeOptions options;
    add_node_options(name, &app, &options);
    all.push_back(text_of(app));
  }
  CLI::App app;
  sim::SimOptions options;
  sim::add_sim_options(&app, &options);
  all.push_back(text_of(app));
  return all;
}

std::string hyphenated(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string one_line(std::string_view lines) {
  return std::regex_replace(std::string(lines), std::regex("\\s*\n\\s*"), " ");
}

}  // namespace rcs::cli
