#pragma once
// The commands that write and read MCAP files.

#include "tools/rcs/command.h"

namespace rcs::cli {

/// @param log  the command `rcs log`
void add_log_mcap_command(CLI::App* log, Commands* commands);
/// @param import  the command `rcs import`
void add_import_mcap_command(CLI::App* import, Commands* commands);

}  // namespace rcs::cli
