#pragma once
// The cells of a view from above, and the scale of their colours.

#include <cstddef>
#include <string>
#include <vector>

#include "tools/report/plot_area.h"
#include "tools/report/svg_plot.h"

namespace rcs::report {

/// Equal steps of value, or of its logarithm, each with a colour.
class ColourScale {
 public:
  explicit ColourScale(const CellMap& map);

  /// Index of the colour of a value; values outside have the first or the last one.
  [[nodiscard]] std::size_t step_of(double value) const;
  /// The value at the lower edge of a step.
  [[nodiscard]] double edge(std::size_t step) const;
  /// Round values.
  [[nodiscard]] std::vector<double> ticks(int count) const;
  /// 0 at the lower end of the scale and 1 at the upper one.
  [[nodiscard]] double share_of(double value) const;

 private:
  bool log_;
  Range range_;  ///< of values, or of their decimal logarithms
};

/// One path for each colour; its attribute data-value is the range of its values. The scales of the
/// axes are linear and equal.
[[nodiscard]] std::string cells_svg(const CellMap& map, const PlotArea& area);

/// At the right of the frame.
[[nodiscard]] std::string colour_bar_svg(const CellMap& map, const PlotArea& area);

}  // namespace rcs::report
