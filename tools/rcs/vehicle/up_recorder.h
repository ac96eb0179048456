#pragma once
// The recorder as a process of `rcs up`.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/params/params.h"

namespace rcs::cli {

/// The program and its arguments.
struct ProcessCommand {
  std::string program;
  std::vector<std::string> arguments;
};

/// @param folder  of the recording; empty: recordings in state_folder() of the configuration
/// @return an error if no folder is given or known
[[nodiscard]] Result<ProcessCommand> recorder_command(const std::string& folder,
                                                      const ParamFile& file,
                                                      const std::string& lcm_url);

}  // namespace rcs::cli
