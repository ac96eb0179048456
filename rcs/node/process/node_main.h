#pragma once
// The main function that all node processes share.

#include <functional>
#include <memory>
#include <string_view>

#include "rcs/base/result.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"

namespace rcs {

/// Reads its tables of the vehicle's configuration and builds the node on the bus.
using NodeFactory = std::function<Result<std::unique_ptr<Node>>(const ParamFile&, Bus*)>;

/// `name CONFIG [--lcm-url URL]`: runs the node live until Ctrl-C or SIGTERM, then prints the run's
/// account. Events are printed to stderr as they are reported; <NAME>_PROCESS is published once a
/// second. `--check` only reads the configuration and builds the node.
/// @param for_check  builds the node for `--check`, where `factory` would create files; empty: the
///                   same
/// @return kExitOk: stopped on request; kExitInput: cannot start, or the bus failed; kExitNegative:
///         rejected by --check; kExitUsage
int node_main(int argc, char** argv, std::string_view name, const NodeFactory& factory,
              const NodeFactory& for_check = {});

}  // namespace rcs
