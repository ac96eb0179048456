#include "rcs/node/bus/bus_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "rcs/node/bus/lcm_bus.h"

namespace rcs {

CLI::Option* add_bus_option(CLI::App* app, std::string* url) {
  return app
      ->add_option("--lcm-url", *url,
                   fmt::format("LCM bus; default: $LCM_DEFAULT_URL, else {}", kDefaultLcmUrl))
      ->type_name("URL");
}

}  // namespace rcs
