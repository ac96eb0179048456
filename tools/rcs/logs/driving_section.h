#pragma once
// The section of a page about what BG drove.

#include <optional>
#include <string>

#include "rcs/base/result.h"
#include "tools/evaluation/driving_plot.h"
#include "tools/report/html_page.h"

namespace rcs::cli {

/// Adds nothing for a log in which BG has planned no path.
inline void add_driving(const std::string& log, report::HtmlPage* page) {
  const Result<std::optional<report::Plot>> plot = evaluation::driving_plot(log);
  if (!plot || !*plot) return;
  page->heading("Driving");
  page->paragraph(
      "Cells: obstacles in the last map of WM that contained them, by the height of their step; an "
      "edge that hides ground has none. Numbers: waypoints of the longest command. Circles: "
      "horizontal "
      "protection level, every 15 m of the course; levels above 100 m are not drawn.");
  page->plot(**plot);
}

}  // namespace rcs::cli
