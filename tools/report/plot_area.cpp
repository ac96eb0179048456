#include "tools/report/plot_area.h"

#include <algorithm>
#include <cmath>

namespace rcs::report {
namespace {

constexpr double kLeft_px = 68.0;
constexpr double kRight_px = 18.0;
constexpr double kBottom_px = 46.0;
constexpr double kTitle_px = 26.0;
constexpr double kLegend_px = 22.0;
constexpr double kBarOfColours_px = 74.0;

double coordinate(double v, bool log) {
  if (!log) return v;
  return v > 0.0 ? std::log10(v) : std::numeric_limits<double>::quiet_NaN();
}

void fit_to_data(const Plot& plot, PlotArea* area) {
  const auto add_y = [&](double v) { area->y.add(coordinate(v, plot.log_y)); };
  for (const Series& s : plot.series) {
    for (const double v : s.x) area->x.add(coordinate(v, plot.log_x));
    for (const double v : s.y) add_y(v);
    for (const double v : s.y_low) add_y(v);
    // One count is half a decade tall, so that it is visible.
    if (s.style == SeriesStyle::kBars) area->y.add(plot.log_y ? -0.3 : 0.0);
  }
  for (const Mark& m : plot.marks) {
    area->x.add(m.x);
    add_y(m.y);
  }
  if (plot.map) {
    for (const CellMap::Cell& c : plot.map->cells) {
      for (const int side : {0, 1}) {
        area->x.add((c.i + side) * plot.map->cell);
        area->y.add((c.j + side) * plot.map->cell);
      }
    }
  }
  if (plot.y_from_zero) area->y.add(0.0);
  area->x.widen();
  area->y.widen();
  const double y_margin = 0.05 * area->y.span();
  if (!plot.log_y && !(plot.y_from_zero && area->y.low == 0.0)) area->y.low -= y_margin;
  area->y.high += y_margin;
  if (plot.equal_scales) {
    const double x_margin = 0.05 * area->x.span();
    area->x.low -= x_margin;
    area->x.high += x_margin;
  }
}

/// Sets both scales to the coarser one.
void equalize(PlotArea* area) {
  const double unit_x = area->x.span() / (area->right - area->left);
  const double unit_y = area->y.span() / (area->bottom - area->top);
  const double unit = std::max(unit_x, unit_y);
  const double more_x = unit * (area->right - area->left) - area->x.span();
  const double more_y = unit * (area->bottom - area->top) - area->y.span();
  area->x = {area->x.low - 0.5 * more_x, area->x.high + 0.5 * more_x};
  area->y = {area->y.low - 0.5 * more_y, area->y.high + 0.5 * more_y};
}

}  // namespace

void Range::add(double v) {
  if (!std::isfinite(v)) return;
  low = std::min(low, v);
  high = std::max(high, v);
}

void Range::widen() {
  if (low > high) *this = {0.0, 1.0};
  if (span() < 1e-9) {
    low -= 0.5;
    high += 0.5;
  }
}

double PlotArea::px(double value) const {
  return left + (coordinate(value, log_x) - x.low) / x.span() * (right - left);
}

double PlotArea::py(double value) const {
  return bottom - (coordinate(value, log_y) - y.low) / y.span() * (bottom - top);
}

double text_width_px(std::string_view text) { return 6.7 * static_cast<double>(text.size()); }

bool has_legend(const Plot& plot) {
  return std::any_of(plot.series.begin(), plot.series.end(),
                     [](const Series& s) { return !s.label.empty(); });
}

double legend_y_px(const Plot& plot) { return (plot.title.empty() ? 8.0 : kTitle_px) + 6.0; }

PlotArea area_of(const Plot& plot) {
  PlotArea area;
  area.log_x = plot.log_x;
  area.log_y = plot.log_y;
  if (plot.window) {
    area.x = {plot.window->x_low, plot.window->x_high};
    area.y = {plot.window->y_low, plot.window->y_high};
  } else {
    fit_to_data(plot, &area);
  }
  area.left = kLeft_px;
  for (const std::string& name : plot.y_names) {
    area.left = std::max(area.left, text_width_px(name) + 10.0);
  }
  area.right = plot.width_px - kRight_px - (plot.map ? kBarOfColours_px : 0.0);
  area.top = (plot.title.empty() ? 8.0 : kTitle_px) + (has_legend(plot) ? kLegend_px : 4.0);
  area.bottom = plot.height_px - kBottom_px;
  if (plot.equal_scales) equalize(&area);
  return area;
}

}  // namespace rcs::report
