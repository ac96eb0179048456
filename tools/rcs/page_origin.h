#pragma once
// What made a page: the command line, the version and the date.

#include <string>

#include "tools/report/html_page.h"

namespace rcs::cli {

/// Call it once, before the first page_origin().
void note_command_line(int argc, char** argv);

/// @param configuration  of the vehicle; empty: none
[[nodiscard]] report::PageOrigin page_origin(const std::string& configuration = "");

/// A word of a command line as a shell reads it.
[[nodiscard]] std::string shell_word(const std::string& word);

}  // namespace rcs::cli
