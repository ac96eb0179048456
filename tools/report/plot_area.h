#pragma once
// The frame of a plot: which values it shows, and where they are in pixels.

#include <limits>
#include <string_view>

#include "tools/report/svg_plot.h"

namespace rcs::report {

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  /// Non-finite values are ignored.
  void add(double v);
  /// Not empty afterwards: [0, 1] without a value, one unit around a single value.
  void widen();
  [[nodiscard]] double span() const { return high - low; }
};

struct PlotArea {
  double left = 0.0;  ///< of the frame [px]
  double right = 0.0;
  double top = 0.0;
  double bottom = 0.0;
  Range x;  ///< at the edges of the frame: values, or their decimal logarithms if log_x
  Range y;
  bool log_x = false;
  bool log_y = false;

  /// In pixels; not finite for a value that cannot be drawn.
  [[nodiscard]] double px(double value) const;
  [[nodiscard]] double py(double value) const;
};

/// Approximate, because fonts differ.
[[nodiscard]] double text_width_px(std::string_view text);

/// The data or the window of the plot with margins, in the space that title, legend, labels and
/// colour bar leave.
[[nodiscard]] PlotArea area_of(const Plot& plot);

/// A series has an entry in the legend.
[[nodiscard]] bool has_legend(const Plot& plot);

/// Vertical position of the legend [px].
[[nodiscard]] double legend_y_px(const Plot& plot);

}  // namespace rcs::report
