#pragma once
// The generated documents. Each function returns the text of one file.

#include <string>
#include <vector>

#include "tools/rcs/reference/lcm_file.h"
#include "tools/rcs/reference/programs.h"

namespace rcs::cli {

/// docs/reference/cli.md
[[nodiscard]] std::string cli_page(const ProgramText& rcs);
/// docs/reference/configuration.md
[[nodiscard]] std::string configuration_page();
/// docs/reference/messages.md
[[nodiscard]] std::string messages_page(const std::vector<LcmType>& types);
/// docs/reference/events.md
[[nodiscard]] std::string events_page();

/// A page in the format of man(7).
/// @param rcs  has the exit status of all commands
[[nodiscard]] std::string man_page(const ProgramText& program, const ProgramText& rcs);

/// A script for bash that completes commands, options and enumerated values.
[[nodiscard]] std::string bash_completion(const ProgramText& rcs);

/// A text in a cell of a Markdown table, where some characters have a meaning.
[[nodiscard]] std::string markdown(std::string text);

}  // namespace rcs::cli
