#include "tools/rcs/reference/programs.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <string_view>

#include "rcs/node/process/node_options.h"
#include "sim/sim_options.h"

namespace rcs::cli {

std::vector<std::string> exit_status(const ProgramText& program) {
  constexpr std::string_view kBegin = "Exit status: ";
  std::vector<std::string> all;
  for (const TextBlock& block : program.description) {
    const std::size_t begin = block.text.find(kBegin);
    if (begin == std::string::npos) continue;
    const std::size_t end = block.text.find(".\n", begin);
    std::istringstream in(block.text.substr(begin + kBegin.size(), end - begin - kBegin.size()));
    for (std::string one; std::getline(in >> std::ws, one, ';');)
      all.push_back(command_line::one_line(one));
  }
  return all;
}

std::vector<ProgramText> other_programs() {
  std::vector<ProgramText> all;
  for (const char* name : {"sp", "wm", "bg", "mission", "gateway", "ros2_bridge"}) {
    CLI::App app;
    NodeOptions options;
    add_node_options(name, &app, &options);
    all.push_back(command_line::program_text(app, app.get_name()));
  }
  CLI::App app;
  sim::SimOptions options;
  sim::add_sim_options(&app, &options);
  all.push_back(command_line::program_text(app, app.get_name()));
  return all;
}

std::string hyphenated(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

}  // namespace rcs::cli
