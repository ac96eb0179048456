#include "tools/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tools/report/colour_map.h"
#include "tools/report/plot_area.h"
#include "tools/report/series_path.h"

namespace rcs::report {
namespace {

class Canvas {
 public:
  explicit Canvas(const Plot& plot) : plot_(plot), area_(area_of(plot)) {}

  std::string draw(bool standalone) {
    begin(standalone);
    draw_shades();
    draw_axes();
    emit("<g clip-path=\"url(#{})\"><g class=\"data\">\n", clip_id());
    if (plot_.map) out_ += cells_svg(*plot_.map, area_);
    for (const Series& s : plot_.series) draw_series(s);
    emit("</g></g>\n");
    draw_marks();
    draw_legend();
    if (plot_.map) out_ += colour_bar_svg(*plot_.map, area_);
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

  void begin(bool standalone) {
    emit("<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\"", plot_.width_px,
         plot_.height_px, escape_xml(plot_.title));
    emit_axes_as_data();
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
      emit("<text class=\"title\" x=\"{}\" y=\"17\">{}</text>\n", area_.left,
           escape_xml(plot_.title));
    }
    emit(
        "<clipPath id=\"{}\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
        "height=\"{:.1f}\"/></clipPath>\n",
        clip_id(), area_.left, area_.top, area_.right - area_.left, area_.bottom - area_.top);
  }

  /// For plot.js: what a position inside the frame is.
  void emit_axes_as_data() {
    emit(
        " data-frame=\"{:.2f} {:.2f} {:.2f} {:.2f}\" data-x=\"{:.9g} {:.9g}\" "
        "data-y=\"{:.9g} {:.9g}\" data-x-label=\"{}\" data-y-label=\"{}\"",
        area_.left, area_.top, area_.right, area_.bottom, area_.x.low, area_.x.high, area_.y.low,
        area_.y.high, escape_xml(plot_.x_label), escape_xml(plot_.y_label));
    if (plot_.log_x) emit(" data-log-x=\"1\"");
    if (plot_.log_y) emit(" data-log-y=\"1\"");
    if (plot_.equal_scales) emit(" data-equal=\"1\"");
    if (!plot_.y_names.empty()) emit(" data-lanes=\"1\"");
    if (plot_.map) emit(" data-map-label=\"{}\"", escape_xml(plot_.map->value_label));
  }

  void draw_shades() {
    const auto limit = [](const Range& r, double v) { return std::clamp(v, r.low, r.high); };
    for (const Shade& s : plot_.shades) {
      const double from = area_.px(limit(area_.x, s.from));
      const double to = area_.px(limit(area_.x, s.to));
      if (to <= from) continue;
      emit("<rect class=\"shade\" x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.1f}\"/>\n",
           from, area_.top, to - from, area_.bottom - area_.top);
      if (s.label.empty()) continue;
      // A hidden label appears when its interval is magnified.
      const bool narrow = to - from < 10.0 + text_width_px(s.label);
      emit("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\"{}>{}</text>\n", from + 5.0,
           area_.top + 13.0, narrow ? " visibility=\"hidden\"" : "", escape_xml(s.label));
    }
  }

  void draw_axes() {
    const double width = area_.right - area_.left;
    const double height = area_.bottom - area_.top;
    const auto count = [](double length, double each) {
      return std::max(2, static_cast<int>(length / each));
    };
    emit("<g class=\"x-ticks\">\n");
    for (const double x : plot_.log_x
                              ? log_ticks(std::pow(10.0, area_.x.low), std::pow(10.0, area_.x.high),
                                          count(width, 60.0))
                              : round_ticks(area_.x.low, area_.x.high, count(width, 90.0))) {
      draw_x_tick(area_.px(x), axis_number(x));
    }
    emit("</g>\n<g class=\"y-ticks\">\n");
    if (!plot_.y_names.empty()) {
      for (std::size_t k = 0; k < plot_.y_names.size(); ++k) {
        draw_y_tick(area_.py(static_cast<double>(k)), plot_.y_names[k]);
      }
    } else {
      for (const double y : plot_.log_y
                                ? log_ticks(std::pow(10.0, area_.y.low),
                                            std::pow(10.0, area_.y.high), count(height, 20.0))
                                : round_ticks(area_.y.low, area_.y.high, count(height, 45.0))) {
        draw_y_tick(area_.py(y), axis_number(y));
      }
    }
    emit("</g>\n<path class=\"axis\" d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\"/>\n", area_.left, area_.top,
         area_.bottom, area_.right);
    emit("<text class=\"label mid\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
         0.5 * (area_.left + area_.right), area_.bottom + 36.0, escape_xml(plot_.x_label));
    emit("<text class=\"label mid\" transform=\"translate(16 {:.1f}) rotate(-90)\">{}</text>\n",
         0.5 * (area_.top + area_.bottom), escape_xml(plot_.y_label));
  }
  void draw_x_tick(double x, const std::string& text) {
    emit(
        "<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>"
        "<text class=\"tick mid\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        x, area_.top, area_.bottom, x, area_.bottom + 16.0, text);
  }
  void draw_y_tick(double y, const std::string& text) {
    emit(
        "<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>"
        "<text class=\"tick end\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        area_.left, y, area_.right, area_.left - 6.0, y + 4.0, escape_xml(text));
  }

  void draw_series(const Series& s) {
    emit("<path class=\"{} {}\" data-label=\"{}\" d=\"{}\"/>\n", style_class(s.style),
         colour_class(s.colour), escape_xml(s.label), path_of(s, area_));
  }

  void draw_marks() {
    for (const Mark& m : plot_.marks) {
      emit(
          "<g class=\"place\" transform=\"translate({:.2f} {:.2f})\"><circle class=\"mark\" "
          "r=\"4\"/><text class=\"label halo\" x=\"8\" y=\"-6\">{}</text></g>\n",
          area_.px(m.x), area_.py(m.y), escape_xml(m.label));
    }
  }

  void draw_legend() {
    double x = area_.left;
    const double y = legend_y_px(plot_);
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
  PlotArea area_;
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
