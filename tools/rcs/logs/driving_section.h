#pragma once
// The section of a page about what BG drove, and the routes that the mission chose.

#include <string>

#include "tools/report/html_page.h"

namespace rcs::cli {

/// Adds nothing for a log in which BG has planned no path.
void add_driving(const std::string& log, report::HtmlPage* page);

}  // namespace rcs::cli
