#include "tools/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "tools/report/viridis.h"

namespace rcs::report {
namespace {

constexpr double kLeft_px = 68.0;
constexpr double kRight_px = 18.0;
constexpr double kBottom_px = 46.0;
constexpr double kTitle_px = 26.0;
constexpr double kLegend_px = 22.0;
constexpr double kBarOfColours_px = 74.0;
constexpr std::size_t kMaxPointsOfALine = 4000;

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  [[nodiscard]] double span() const { return high - low; }
};

std::string_view colour_class(Colour colour) {
  switch (colour) {
    case Colour::kBlue:
      return "c-blue";
    case Colour::kOrange:
      return "c-orange";
    case Colour::kGreen:
      return "c-green";
    case Colour::kPurple:
      return "c-purple";
    case Colour::kYellow:
      return "c-yellow";
    case Colour::kGrey:
      return "c-grey";
  }
  return "c-grey";
}

std::string_view style_class(SeriesStyle style) {
  switch (style) {
    case SeriesStyle::kLine:
      return "line";
    case SeriesStyle::kThickLine:
      return "thick";
    case SeriesStyle::kDashed:
      return "dashed";
    case SeriesStyle::kBand:
      return "band";
    case SeriesStyle::kBars:
      return "bars";
    case SeriesStyle::kHair:
      return "hair";
    case SeriesStyle::kDots:
      return "dots";
  }
  return "line";
}

/// Approximate, because fonts differ.
double text_width_px(std::string_view text) { return 6.7 * static_cast<double>(text.size()); }

class Canvas {
 public:
  explicit Canvas(const Plot& plot) : plot_(plot) {
    fit_ranges();
    left_ = kLeft_px;
    for (const std::string& name : plot.y_names) {
      left_ = std::max(left_, text_width_px(name) + 10.0);
    }
    right_ = plot.width_px - kRight_px - (plot.map ? kBarOfColours_px : 0.0);
    top_ = (plot.title.empty() ? 8.0 : kTitle_px) + (has_legend() ? kLegend_px : 4.0);
    bottom_ = plot.height_px - kBottom_px;
    if (plot.equal_scales) equalize();
  }

  std::string draw(bool standalone) {
    emit("<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\"", plot_.width_px,
         plot_.height_px, escape_xml(plot_.title));
    if (standalone) {
      emit(" xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\"", plot_.width_px,
           plot_.height_px);
    }
    emit(">\n");
    if (standalone) {
      emit("<style>{}</style>\n<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n",
           plot_style());
    }
    if (!plot_.title.empty()) {
      emit("<text class=\"title\" x=\"{}\" y=\"17\">{}</text>\n", left_, escape_xml(plot_.title));
    }
    emit(
        "<clipPath id=\"{}\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
        "height=\"{:.1f}\"/></clipPath>\n",
        clip_id(), left_, top_, right_ - left_, bottom_ - top_);
    draw_shades();
    draw_axes();
    emit("<g clip-path=\"url(#{})\">\n", clip_id());
    if (plot_.map) draw_cells();
    for (const Series& s : plot_.series) draw_series(s);
    emit("</g>\n");
    draw_marks();
    draw_legend();
    if (plot_.map) draw_bar_of_colours();
    emit("</svg>\n");
    return std::move(out_);
  }

 private:
  template <class... Args>
  void emit(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out_), format, std::forward<Args>(args)...);
  }

  // Ids must be unique among the plots of a page.
  [[nodiscard]] std::string clip_id() const {
    return fmt::format("clip-{:x}", std::hash<std::string>()(plot_.title + plot_.y_label));
  }
  [[nodiscard]] bool has_legend() const {
    return std::any_of(plot_.series.begin(), plot_.series.end(),
                       [](const Series& s) { return !s.label.empty(); });
  }

  void fit_ranges() {
    if (plot_.map) {
      for (const CellMap::Cell& c : plot_.map->cells) value_.add(c.value);
      widen(&value_);
    }
    if (plot_.window) {
      x_ = {plot_.window->x_low, plot_.window->x_high};
      y_ = {plot_.window->y_low, plot_.window->y_high};
      return;
    }
    for (const Series& s : plot_.series) {
      for (const double v : s.x) add_x(v);
      for (const double v : s.y) add_y(v);
      for (const double v : s.y_low) add_y(v);
      // One count is half a decade tall, so that it is visible.
      if (s.style == SeriesStyle::kBars) y_.add(plot_.log_y ? -0.3 : 0.0);
    }
    for (const Mark& m : plot_.marks) {
      x_.add(m.x);
      add_y(m.y);
    }
    if (plot_.map) {
      for (const CellMap::Cell& c : plot_.map->cells) {
        x_.add(c.i * plot_.map->cell);
        x_.add((c.i + 1) * plot_.map->cell);
        y_.add(c.j * plot_.map->cell);
        y_.add((c.j + 1) * plot_.map->cell);
      }
    }
    if (plot_.y_from_zero) y_.add(0.0);
    widen(&x_);
    widen(&y_);
    const double y_margin = plot_.log_y ? 0.0 : 0.05 * y_.span();
    if (!(plot_.y_from_zero && y_.low == 0.0)) y_.low -= y_margin;
    y_.high += y_margin;
    if (plot_.equal_scales) {
      const double x_margin = 0.05 * x_.span();
      x_.low -= x_margin;
      x_.high += x_margin;
    }
  }
  void add_x(double v) {
    if (!plot_.log_x) x_.add(v);
    if (plot_.log_x && v > 0.0) x_.add(std::log10(v));
  }
  void add_y(double v) {
    if (!plot_.log_y) y_.add(v);
    if (plot_.log_y && v > 0.0) y_.add(std::log10(v));
  }
  static void widen(Range* r) {
    if (r->low > r->high) *r = {0.0, 1.0};
    if (r->span() < 1e-9) {
      r->low -= 0.5;
      r->high += 0.5;
    }
  }
  /// Sets both scales to the coarser one.
  void equalize() {
    const double unit_x = x_.span() / (right_ - left_);
    const double unit_y = y_.span() / (bottom_ - top_);
    const double unit = std::max(unit_x, unit_y);
    const double more_x = unit * (right_ - left_) - x_.span();
    const double more_y = unit * (bottom_ - top_) - y_.span();
    x_ = {x_.low - 0.5 * more_x, x_.high + 0.5 * more_x};
    y_ = {y_.low - 0.5 * more_y, y_.high + 0.5 * more_y};
  }

  [[nodiscard]] double px_linear(double x) const {
    return left_ + (x - x_.low) / x_.span() * (right_ - left_);
  }
  /// Not finite where it cannot be drawn.
  [[nodiscard]] double px(double x) const {
    if (!plot_.log_x) return px_linear(x);
    return x > 0.0 ? px_linear(std::log10(x)) : std::numeric_limits<double>::quiet_NaN();
  }
  [[nodiscard]] double py_linear(double y) const {
    return bottom_ - (y - y_.low) / y_.span() * (bottom_ - top_);
  }
  /// Not finite where it cannot be drawn.
  [[nodiscard]] double py(double y) const {
    if (!plot_.log_y) return py_linear(y);
    return y > 0.0 ? py_linear(std::log10(y)) : std::numeric_limits<double>::quiet_NaN();
  }

  void draw_shades() {
    for (const Shade& s : plot_.shades) {
      const double from = px(std::clamp(s.from, x_.low, x_.high));
      const double to = px(std::clamp(s.to, x_.low, x_.high));
      if (to <= from) continue;
      emit("<rect class=\"shade\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
           from, top_, to - from, bottom_ - top_);
      if (to - from < 10.0 + text_width_px(s.label)) continue;
      emit("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", from + 5.0, top_ + 13.0,
           escape_xml(s.label));
    }
  }

  void draw_axes() {
    const int x_count = std::max(2, static_cast<int>((right_ - left_) / 90.0));
    const int y_count = std::max(2, static_cast<int>((bottom_ - top_) / 45.0));
    if (plot_.log_x) {
      for (int e = static_cast<int>(std::ceil(x_.low)); e <= x_.high; ++e) {
        draw_x_tick(e, std::pow(10.0, e));
      }
    } else {
      for (const double x : round_ticks(x_.low, x_.high, x_count)) draw_x_tick(x, x);
    }
    if (plot_.log_y) {
      for (int e = static_cast<int>(std::ceil(y_.low)); e <= y_.high; ++e) {
        draw_y_tick(e, number(std::pow(10.0, e)));
      }
      if (std::floor(y_.high) < std::ceil(y_.low)) {
        draw_y_tick(y_.high, number(std::pow(10.0, y_.high)));
      }
    } else if (!plot_.y_names.empty()) {
      for (std::size_t k = 0; k < plot_.y_names.size(); ++k) {
        draw_y_tick(static_cast<double>(k), plot_.y_names[k]);
      }
    } else {
      for (const double y : round_ticks(y_.low, y_.high, y_count)) draw_y_tick(y, number(y));
    }
    emit("<path class=\"axis\" d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\"/>\n", left_, top_, bottom_,
         right_);
    emit("<text class=\"label mid\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", 0.5 * (left_ + right_),
         bottom_ + 36.0, escape_xml(plot_.x_label));
    emit("<text class=\"label mid\" transform=\"translate(16 {:.1f}) rotate(-90)\">{}</text>\n",
         0.5 * (top_ + bottom_), escape_xml(plot_.y_label));
  }
  void draw_x_tick(double at, double value) {
    emit(
        "<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>"
        "<text class=\"tick mid\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        px_linear(at), top_, bottom_, px_linear(at), bottom_ + 16.0, number(value));
  }
  void draw_y_tick(double at, const std::string& text) {
    emit(
        "<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>"
        "<text class=\"tick end\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        left_, py_linear(at), right_, left_ - 6.0, py_linear(at) + 4.0, escape_xml(text));
  }
  static std::string number(double v) {
    return fmt::format("{:.6g}", std::abs(v) < 1e-9 ? 0.0 : v);  // no -0, no 1e-17
  }

  void draw_series(const Series& s) {
    std::string path;
    if (s.style == SeriesStyle::kBand) {
      path = band_path(s);
    } else if (s.style == SeriesStyle::kBars) {
      path = bars_path(s);
    } else if (s.style == SeriesStyle::kDots) {
      path = dots_path(s);
    } else {
      path = line_path(s);
    }
    emit("<path class=\"{} {}\" d=\"{}\"/>\n", style_class(s.style), colour_class(s.colour), path);
  }

  [[nodiscard]] std::string line_path(const Series& s) const {
    std::string path;
    bool pen_down = false;
    const bool all = s.style == SeriesStyle::kHair;
    const std::size_t stride = all ? 1 : 1 + s.x.size() / kMaxPointsOfALine;
    for (std::size_t i = 0; i < s.x.size(); i += stride) {
      const double x = px(s.x[i]);
      const double y = py(s.y[i]);
      if (!std::isfinite(x) || !std::isfinite(y)) {
        pen_down = false;
        continue;
      }
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", pen_down ? "L" : "M", x, y);
      pen_down = true;
    }
    return path;
  }

  [[nodiscard]] std::string band_path(const Series& s) const {
    std::string path;
    const std::size_t stride = 1 + s.x.size() / kMaxPointsOfALine;
    for (std::size_t i = 0; i < s.x.size(); i += stride) {
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", i == 0 ? "M" : "L", px(s.x[i]),
                     py(s.y[i]));
    }
    for (std::size_t k = s.x.size(); k > 0; k -= std::min(k, stride)) {
      fmt::format_to(std::back_inserter(path), "L{:.1f} {:.1f}", px(s.x[k - 1]),
                     py(s.y_low[k - 1]));
    }
    return path.empty() ? path : path + "Z";
  }

  [[nodiscard]] std::string dots_path(const Series& s) const {
    std::string path;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      const double x = px(s.x[i]);
      const double y = py(s.y[i]);
      if (!(x > left_ && x < right_ && y > top_ && y < bottom_)) continue;
      fmt::format_to(std::back_inserter(path), "M{:.1f} {:.1f}h0", x, y);
    }
    return path;
  }

  [[nodiscard]] std::string bars_path(const Series& s) const {
    if (s.x.size() < 2) return {};
    const double width = std::max(1.0, px(s.x[1]) - px(s.x[0]) - 1.0);
    std::string path;
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      const double y = py(s.y[i]);
      if (!std::isfinite(y) || y >= bottom_) continue;
      fmt::format_to(std::back_inserter(path), "M{:.1f} {:.1f}V{:.1f}h{:.1f}V{:.1f}Z", px(s.x[i]),
                     bottom_, y, width, bottom_);
    }
    return path;
  }

  [[nodiscard]] std::size_t step_of(double value) const {
    const double share = (value - value_.low) / value_.span();
    const double step = share * static_cast<double>(kViridis.size());
    return std::min(kViridis.size() - 1, static_cast<std::size_t>(std::max(0.0, step)));
  }

  /// One path per colour, in units of cells; neighbours of one colour along x are one rectangle.
  void draw_cells() {
    std::array<std::string, kViridis.size()> paths;
    const std::vector<CellMap::Cell>& cells = plot_.map->cells;
    for (std::size_t a = 0; a < cells.size();) {
      const std::size_t step = step_of(cells[a].value);
      std::size_t b = a + 1;
      while (b < cells.size() && cells[b].j == cells[a].j && cells[b].i == cells[b - 1].i + 1 &&
             step_of(cells[b].value) == step) {
        ++b;
      }
      fmt::format_to(std::back_inserter(paths[step]), "M{} {}h{}v1H{}z", cells[a].i, cells[a].j,
                     b - a, cells[a].i);
      a = b;
    }
    const double scale = plot_.map->cell / x_.span() * (right_ - left_);
    emit("<g transform=\"translate({:.3f} {:.3f}) scale({:.6f} {:.6f})\">\n", px(0.0),
         py_linear(0.0), scale, -scale);
    for (std::size_t k = 0; k < kViridis.size(); ++k) {
      if (!paths[k].empty()) emit("<path fill=\"{}\" d=\"{}\"/>\n", kViridis[k], paths[k]);
    }
    emit("</g>\n");
  }

  void draw_bar_of_colours() {
    const double x = right_ + 18.0;
    const double step =
        std::min(22.0, (bottom_ - top_ - 20.0) / static_cast<double>(kViridis.size()));
    const double foot = top_ + 24.0 + step * static_cast<double>(kViridis.size());
    emit("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x, top_ + 10.0,
         escape_xml(plot_.map->value_label));
    for (std::size_t k = 0; k < kViridis.size(); ++k) {
      emit("<rect fill=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"14\" height=\"{:.1f}\"/>\n",
           kViridis[k], x, foot - step * static_cast<double>(k + 1), step);
    }
    for (const double share : {0.0, 0.5, 1.0}) {
      emit("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{:.1f}</text>\n", x + 19.0,
           foot - share * step * static_cast<double>(kViridis.size()) + 4.0,
           value_.low + share * value_.span());
    }
  }

  void draw_marks() {
    for (const Mark& m : plot_.marks) {
      emit(
          "<circle class=\"mark\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>"
          "<text class=\"label halo\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
          px(m.x), py(m.y), px(m.x) + 8.0, py(m.y) - 6.0, escape_xml(m.label));
    }
  }

  void draw_legend() {
    double x = left_;
    const double y = (plot_.title.empty() ? 8.0 : kTitle_px) + 6.0;
    for (const Series& s : plot_.series) {
      if (s.label.empty()) continue;
      if (s.style == SeriesStyle::kBand || s.style == SeriesStyle::kBars) {
        emit("<rect class=\"{} {}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"20\" height=\"9\"/>",
             style_class(s.style), colour_class(s.colour), x, y - 4.5);
      } else {
        // A single hair or dot would hardly be visible.
        const bool dots = s.style == SeriesStyle::kDots;
        const SeriesStyle style = s.style == SeriesStyle::kHair ? SeriesStyle::kLine : s.style;
        emit("<path class=\"{} {}\" d=\"M{:.1f} {:.1f}{}\"/>", style_class(style),
             colour_class(s.colour), x, y, dots ? "h0m4 3h0m4-5h0m4 4h0m4-3h0m3 2h0" : "h20");
      }
      emit("<text class=\"label\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x + 26.0, y + 4.0,
           escape_xml(s.label));
      x += 26.0 + text_width_px(s.label) + 22.0;
    }
  }

  const Plot& plot_;
  Range x_;
  Range y_;  ///< decades when log_y
  Range value_;
  double left_ = 0.0;
  double right_ = 0.0;
  double top_ = 0.0;
  double bottom_ = 0.0;
  std::string out_;
};

}  // namespace

Plot view_from_above(std::string title, bool world, int height_px) {
  Plot plot;
  plot.title = std::move(title);
  plot.x_label = world ? "east [m]" : "x [m]";
  plot.y_label = world ? "north [m]" : "y [m]";
  plot.height_px = height_px;
  plot.equal_scales = true;
  return plot;
}

std::string render(const Plot& plot, bool standalone) { return Canvas(plot).draw(standalone); }

std::string render_stacked(const std::vector<Plot>& plots) {
  std::string inner;
  int width_px = 0;
  int height_px = 0;
  for (const Plot& plot : plots) {
    inner += fmt::format("<svg y=\"{}\" width=\"{}\" height=\"{}\">\n{}</svg>\n", height_px,
                         plot.width_px, plot.height_px, render(plot, false));
    width_px = std::max(width_px, plot.width_px);
    height_px += plot.height_px;
  }
  return fmt::format(
      "<svg class=\"plot\" viewBox=\"0 0 {0} {1}\" xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"{0}\" height=\"{1}\">\n<style>{2}</style>\n"
      "<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n{3}</svg>\n",
      width_px, height_px, plot_style(), inner);
}

}  // namespace rcs::report
