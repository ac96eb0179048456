#pragma once
// Figures 2 and 3 of the paper (Madhavan and Messina), from pairs of scans of this project: the
// range images, the scans before and after their registration, the search for closest points, and
// the distances of the closest points.

#include <optional>
#include <string>
#include <vector>

#include "sim/scenario.h"
#include "tools/report/html_page.h"
#include "tools/report/svg_plot.h"
#include "tools/report/table.h"
#include "tools/studies/figures/scan_picture.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::studies {

/// The scans of the figures.
struct FigureSource {
  std::string name;   ///< in titles
  std::string file;   ///< begin of the names of the files
  std::string about;  ///< what they are, and where their true motion is from: sentences
  ImageShape image;
  VehicleShape vehicle;
};
/// Cuts of KITTI. The vehicle is drawn with its nominal size.
[[nodiscard]] FigureSource kitti_source();
/// Scans of the range imager of a scenario.
/// @param scenario_name  in the text
[[nodiscard]] FigureSource simulation_source(const sim::Scenario& scenario,
                                             const std::string& scenario_name);

struct PaperFigure {
  std::string number;    ///< in the paper: "2 (a)"
  std::string file;      ///< "kitti_figure_2a.svg"
  std::string title;     ///< what it shows
  std::string in_paper;  ///< the paper's caption in other words
  std::string here;      ///< what is shown here, with values
  std::vector<report::Plot> plots;
};

/// All figures of a source, with the values of its registrations.
struct FigureSet {
  FigureSource source;
  report::Table table;
  std::vector<PaperFigure> figures;
};

/// @param consecutive  a trial of data set #1: figure 2
/// @param distant      a trial of data set #3: figure 3
/// The scans of the trials are not empty.
[[nodiscard]] FigureSet paper_figures(FigureSource source, const ScanSet& scans,
                                      const Trial& consecutive, const Trial& distant);

/// The figures below the captions of the paper.
[[nodiscard]] std::string paper_figures_page(const std::vector<FigureSet>& sets,
                                             const report::PageOrigin& origin);

}  // namespace rcs::studies
