#pragma once
// The path of a series in a plot.

#include <string>
#include <string_view>

#include "tools/report/plot_area.h"
#include "tools/report/svg_plot.h"

namespace rcs::report {

/// In hundredths of a pixel: plot.js reads values from paths and magnifies them. It knows these
/// forms: lines and dots "M x y L x y ...", a band "M upper L upper ... L lower ... Z" with as many
/// lower corners as upper ones, in reverse order, and bars "M x bottom V y h width V bottom Z".
/// @return the attribute d of the path
[[nodiscard]] std::string path_of(const Series& series, const PlotArea& area);

/// Classes of the style sheet.
[[nodiscard]] std::string_view style_class(SeriesStyle style);
[[nodiscard]] std::string_view colour_class(Colour colour);

}  // namespace rcs::report
