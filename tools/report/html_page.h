#pragma once
// One self-contained HTML page: no external resources, readable in light and dark, and without
// scripts. One embedded script (plot.js) adds to its plots the values under the pointer and zoom.

#include <string>
#include <string_view>
#include <vector>

#include "tools/report/svg_plot.h"
#include "tools/report/table.h"

namespace rcs::report {

/// What made a page; shown below its title.
struct PageOrigin {
  std::string command;        ///< line
  std::string configuration;  ///< of the vehicle; empty: none is named
  std::string program;        ///< name and version
  std::string date;           ///< UTC
};

/// A moment of a log, opened in the viewer by a link.
struct Moment {
  std::string what;
  double t_s = 0.0;  ///< after the first event of the log
};

/// The address of a moment in a viewer with its default port. The page of the viewer reports
/// another log than this one.
/// @param log  path, also as a word of a shell
[[nodiscard]] std::string viewer_link(std::string_view log, double t_s);

class HtmlPage {
 public:
  HtmlPage(std::string_view title, const PageOrigin& origin);

  void verdict(bool passed, std::string_view text);
  /// @param text  states why there is none
  void without_verdict(std::string_view text);
  /// Links to the viewer, which must show the log: the page names the command.
  void moments(std::string_view log, const std::vector<Moment>& moments);

  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// The first column is left-aligned, the others to the right.
  void table(const Table& table);
  void plot(const Plot& plot);

  [[nodiscard]] std::string finish() const;

 private:
  std::string body_;
  std::string title_;
  std::string origin_;
  bool has_plots_ = false;
};

}  // namespace rcs::report
