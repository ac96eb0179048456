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
      "Ground by its largest step; obstacles are at least 0.5 m in this scale. White: not "
      "observed. "
      "Numbers: waypoints of the command. Circles: horizontal protection level, every 15 m of the "
      "course; levels above 100 m are not drawn.");
  page->plot(**plot);
}

}  // namespace rcs::cli
