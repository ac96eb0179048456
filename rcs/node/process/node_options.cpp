#include "rcs/node/process/node_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <utility>

#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"

namespace rcs {
namespace {

/// What the nodes of this system do; empty for another node.
std::string_view function_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kFunctions = {
      {{"sp", "sensory processing: registers the scans of the LADAR"},
       {"wm", "world model: estimates the state of the vehicle and the terrain around it"},
       {"bg", "behavior generation: turns commands into paths and drive commands"},
       {"mission", "vehicle level: turns tasks into routes, and commands bg"},
       {"gateway", "connection of the vehicle to operators on other computers over DDS"},
       {"ros2_bridge", "exchange of messages with ROS 2 nodes over DDS"}}};
  for (const auto& [node, function] : kFunctions) {
    if (node == name) return function;
  }
  return "";
}

}  // namespace

void add_node_options(std::string_view name, CLI::App* app, NodeOptions* options) {
  app->name(std::string(name));
  const std::string_view function = function_of(name);
  app->description(fmt::format("Node {}{}{}; runs on the LCM bus until Ctrl-C or SIGTERM", name,
                               function.empty() ? "" : ", ", function));
  app->add_option("CONFIG", options->config, "the vehicle's configuration (TOML)")
      ->transform(command_line::config_path())
      ->type_name("FILE")
      ->required();
  add_bus_option(app, &options->url);
  app->add_option("--copy", options->copy,
                  "read this copy of CONFIG, which has the same content as for the other nodes of "
                  "the\nrun; given by `rcs up`")
      ->type_name("FILE");
  app->add_flag("--check", options->check, "check the configuration and exit");
  app->footer(fmt::format(
      "Exit status: 0 stopped by Ctrl-C or SIGTERM, or CONFIG is valid (--check); 1 CONFIG is "
      "invalid\n(--check); 2 invalid command line; 3 CONFIG is invalid, or the bus failed.\n"
      "Example:\n  {} config/demo3.toml",
      name));
}

}  // namespace rcs
