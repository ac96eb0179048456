#pragma once
// One self-contained HTML page: no scripts, no external resources, readable in light and dark.

#include <string>
#include <string_view>

#include "tools/report/svg_plot.h"
#include "tools/report/table.h"

namespace rcs::report {

class HtmlPage {
 public:
  explicit HtmlPage(std::string_view title);

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// The first column is left-aligned, the others to the right.
  void table(const Table& table);
  void plot(const Plot& plot);

  [[nodiscard]] std::string finish() const;

 private:
  std::string body_;
  std::string title_;
};

}  // namespace rcs::report
