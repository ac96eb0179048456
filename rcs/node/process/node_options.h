#pragma once
// The command line that all node processes share.

#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace rcs {

struct NodeOptions {
  std::string config;
  std::string copy;  ///< of config, read instead of it; empty: none
  std::string url;
  bool check = false;  ///< check the configuration only
};

/// Name, description, options and example of the program `name`.
/// @param options  filled by the parser; must outlive it
void add_node_options(std::string_view name, CLI::App* app, NodeOptions* options);

}  // namespace rcs
