#pragma once
// The programs that the generated pages describe.

#include <string>
#include <vector>

#include "rcs/command_line/program_text.h"

namespace rcs::cli {

using command_line::OptionText;
using command_line::ProgramText;
using command_line::TextBlock;

/// "0 success", "1 failure": from the text "Exit status: 0 success; 1 failure." below the options.
[[nodiscard]] std::vector<std::string> exit_status(const ProgramText& program);

/// Programs that are not commands of rcs: the nodes, which share one command line, and sim.
[[nodiscard]] std::vector<ProgramText> other_programs();

/// "rcs log cut" as the name of a man page or an anchor: "rcs-log-cut".
[[nodiscard]] std::string hyphenated(std::string name);

}  // namespace rcs::cli
