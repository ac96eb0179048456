#include "tools/report/series_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace rcs::report {
namespace {

constexpr std::size_t kMaxPointsOfALine = 4000;

struct Corner {
  double x = 0.0;  // [px]
  double y = 0.0;
};

void add(char command, double x, double y, std::string* path) {
  fmt::format_to(std::back_inserter(*path), "{}{:.2f} {:.2f}", command, x, y);
}

std::string line_path(const Series& s, const PlotArea& area) {
  std::string path;
  bool pen_down = false;
  const bool all = s.style == SeriesStyle::kHair;
  const std::size_t stride = all ? 1 : 1 + s.x.size() / kMaxPointsOfALine;
  for (std::size_t i = 0; i < s.x.size(); i += stride) {
    const double x = area.px(s.x[i]);
    const double y = area.py(s.y[i]);
    if (!std::isfinite(x) || !std::isfinite(y)) {
      pen_down = false;
      continue;
    }
    add(pen_down ? 'L' : 'M', x, y, &path);
    pen_down = true;
  }
  return path;
}

void close_band(std::vector<Corner>* upper, std::vector<Corner>* lower, std::string* path) {
  for (std::size_t i = 0; i < upper->size(); ++i) {
    add(i == 0 ? 'M' : 'L', (*upper)[i].x, (*upper)[i].y, path);
  }
  for (std::size_t i = lower->size(); i > 0; --i) {
    add('L', (*lower)[i - 1].x, (*lower)[i - 1].y, path);
  }
  if (!upper->empty()) *path += 'Z';
  upper->clear();
  lower->clear();
}

std::string band_path(const Series& s, const PlotArea& area) {
  std::string path;
  std::vector<Corner> upper;
  std::vector<Corner> lower;
  const std::size_t stride = 1 + s.x.size() / kMaxPointsOfALine;
  for (std::size_t i = 0; i < s.x.size(); i += stride) {
    const double x = area.px(s.x[i]);
    const double y = area.py(s.y[i]);
    const bool below = area.log_y && s.y_low[i] <= 0.0;
    const double y_low = below ? area.bottom : area.py(s.y_low[i]);
    if (std::isfinite(x) && std::isfinite(y) && std::isfinite(y_low)) {
      upper.push_back({x, y});
      lower.push_back({x, y_low});
    } else {
      close_band(&upper, &lower, &path);
    }
  }
  close_band(&upper, &lower, &path);
  return path;
}

std::string dots_path(const Series& s, const PlotArea& area) {
  std::string path;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const double x = area.px(s.x[i]);
    const double y = area.py(s.y[i]);
    if (!(x > area.left && x < area.right && y > area.top && y < area.bottom)) continue;
    add('M', x, y, &path);
    path += "h0";
  }
  return path;
}

std::string bars_path(const Series& s, const PlotArea& area) {
  if (s.x.size() < 2) return {};
  const double width = std::max(1.0, area.px(s.x[1]) - area.px(s.x[0]) - 1.0);
  std::string path;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const double y = area.py(s.y[i]);
    if (!std::isfinite(y) || y >= area.bottom) continue;
    add('M', area.px(s.x[i]), area.bottom, &path);
    fmt::format_to(std::back_inserter(path), "V{:.2f}h{:.2f}V{:.2f}Z", y, width, area.bottom);
  }
  return path;
}

}  // namespace

std::string path_of(const Series& series, const PlotArea& area) {
  switch (series.style) {
    case SeriesStyle::kBand:
      return band_path(series, area);
    case SeriesStyle::kBars:
      return bars_path(series, area);
    case SeriesStyle::kDots:
      return dots_path(series, area);
    case SeriesStyle::kLine:
    case SeriesStyle::kThickLine:
    case SeriesStyle::kDashed:
    case SeriesStyle::kHair:
      break;
  }
  return line_path(series, area);
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

}  // namespace rcs::report
