#pragma once
// The option of all programs that names the bus.

#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace rcs {

/// --lcm-url URL; without it the URL is empty, and LcmBus::create() uses its default.
CLI::Option* add_bus_option(CLI::App* app, std::string* url);

}  // namespace rcs
