#include "rcs/node/process/node_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "rcs/node/bus/lcm_bus.h"

namespace rcs {

void add_node_options(std::string_view name, CLI::App* app, NodeOptions* options) {
  app->name(std::string(name));
  app->description(fmt::format("RCS node {}: runs on the LCM bus until Ctrl-C or SIGTERM", name));
  app->add_option("CONFIG", options->config, "the vehicle's configuration (TOML)")->required();
  app->add_option("--lcm-url", options->url,
                  fmt::format("the bus; default: $LCM_DEFAULT_URL, else {}", kDefaultLcmUrl));
  app->add_option("--copy", options->copy,
                  "read this copy of CONFIG, which has the same content as for the other nodes of "
                  "the\nrun; given by `rcs up`");
  app->add_flag("--check", options->check, "check the configuration and exit");
  app->footer(fmt::format(
      "Exit status: 0 stopped by Ctrl-C or SIGTERM, or CONFIG is valid (--check); 1 CONFIG is "
      "invalid\n(--check); 2 invalid command line; 3 CONFIG is invalid, or the bus failed.\n"
      "Example:\n  {} config/demo3.toml",
      name));
}

}  // namespace rcs
