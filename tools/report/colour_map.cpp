#include "tools/report/colour_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "tools/report/viridis.h"

namespace rcs::report {
namespace {

constexpr double kSteps = static_cast<double>(kViridis.size());

}  // namespace

ColourScale::ColourScale(const CellMap& map) : log_(map.log) {
  for (const CellMap::Cell& c : map.cells) {
    if (!log_) range_.add(c.value);
    if (log_ && c.value > 0.0) range_.add(std::log10(c.value));
  }
  range_.widen();
}

double ColourScale::share_of(double value) const {
  if (log_ && value <= 0.0) return 0.0;
  return ((log_ ? std::log10(value) : value) - range_.low) / range_.span();
}

std::size_t ColourScale::step_of(double value) const {
  const double step = std::max(0.0, share_of(value) * kSteps);
  return std::min(kViridis.size() - 1, static_cast<std::size_t>(std::min(step, kSteps)));
}

double ColourScale::edge(std::size_t step) const {
  const double v = range_.low + range_.span() * static_cast<double>(step) / kSteps;
  return log_ ? std::pow(10.0, v) : v;
}

std::vector<double> ColourScale::ticks(int count) const {
  return log_ ? log_ticks(std::pow(10.0, range_.low), std::pow(10.0, range_.high), count)
              : round_ticks(range_.low, range_.high, count);
}

std::string cells_svg(const CellMap& map, const PlotArea& area) {
  const ColourScale scale(map);
  std::array<std::string, kViridis.size()> paths;  // in units of cells
  const std::vector<CellMap::Cell>& cells = map.cells;
  for (std::size_t a = 0; a < cells.size();) {
    const std::size_t step = scale.step_of(cells[a].value);
    // Neighbours of one colour along x are one rectangle.
    std::size_t b = a + 1;
    while (b < cells.size() && cells[b].j == cells[a].j && cells[b].i == cells[b - 1].i + 1 &&
           scale.step_of(cells[b].value) == step) {
      ++b;
    }
    fmt::format_to(std::back_inserter(paths[step]), "M{} {}h{}v1H{}z", cells[a].i, cells[a].j,
                   b - a, cells[a].i);
    a = b;
  }
  const double size_px = map.cell / area.x.span() * (area.right - area.left);
  std::string svg = fmt::format("<g transform=\"translate({:.3f} {:.3f}) scale({:.6f} {:.6f})\">\n",
                                area.px(0.0), area.py(0.0), size_px, -size_px);
  for (std::size_t k = 0; k < kViridis.size(); ++k) {
    if (paths[k].empty()) continue;
    fmt::format_to(std::back_inserter(svg),
                   "<path fill=\"{}\" data-value=\"{:.3g} to {:.3g}\" d=\"{}\"/>\n", kViridis[k],
                   scale.edge(k), scale.edge(k + 1), paths[k]);
  }
  return svg + "</g>\n";
}

std::string colour_bar_svg(const CellMap& map, const PlotArea& area) {
  const double label_px = map.log ? 20.0 : 32.0;  // height for each value
  const ColourScale scale(map);
  const double x = area.right + 18.0;
  const double step = std::min(22.0, (area.bottom - area.top - 20.0) / kSteps);
  const double height = step * kSteps;
  const double foot = area.top + 24.0 + height;
  std::string svg;
  const auto out = std::back_inserter(svg);
  fmt::format_to(out, "<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x,
                 area.top + 10.0, escape_xml(map.value_label));
  for (std::size_t k = 0; k < kViridis.size(); ++k) {
    fmt::format_to(out,
                   "<rect fill=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"14\" height=\"{:.1f}\"/>\n",
                   kViridis[k], x, foot - step * static_cast<double>(k + 1), step);
  }
  for (const double value : scale.ticks(std::max(2, static_cast<int>(height / label_px)))) {
    const double y = foot - scale.share_of(value) * height;
    fmt::format_to(out,
                   "<path class=\"axis\" d=\"M{:.1f} {:.1f}h3\"/><text class=\"tick\" "
                   "x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                   x + 14.0, y, x + 20.0, y + 4.0, axis_number(value));
  }
  return svg;
}

}  // namespace rcs::report
